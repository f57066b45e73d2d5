"""How kernels are compiled: once per machine, cached beside their source, releasing the GIL.

Every numba function of the project is made by one of the decorators here, so that one place decides the flags. `nnan` and
`ninf` stay off because a NaN of a user function is an error we report, and `reassoc` because range reductions and interval
rounding depend on the order in which they are written.

Numba's cache notices a change only in the file of the function itself, not in what that function calls; after an edit or an
upgrade it would run stale machine code. Here a cached kernel is valid for one state of all files that hold kernels.
"""

from __future__ import annotations

import hashlib
import warnings
from functools import cache
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import IndexDataCacheFile

_FLAGS = {"contract", "nsz", "arcp"}


@cache
def _stamp() -> str:
    """What identifies the state of the sources: a digest of every file that holds kernels."""
    digest = hashlib.blake2b(digest_size=16)
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        text = path.read_bytes()
        if b"jit import" in text or path.name == "jit.py":
            digest.update(text)
    return digest.hexdigest()


def _compiled(function: Any, **options: Any) -> Any:
    dispatcher = njit(cache=True, nogil=True, error_model="numpy", fastmath=_FLAGS, **options)(function)
    held = getattr(dispatcher, "_cache", None)
    implementation = getattr(held, "_impl", None)
    if held is not None and implementation is not None:
        held._cache_file = IndexDataCacheFile(
            cache_path=held._cache_path, filename_base=implementation.filename_base, source_stamp=_stamp()
        )
        held.save_overload = _tolerant(held.save_overload)
    return dispatcher


def _tolerant(save: Any) -> Any:
    """A cache that cannot be written (a full disk) costs the next run its compilation, nothing else."""

    def save_or_warn(*arguments: Any) -> None:
        try:
            save(*arguments)
        except OSError as error:
            warnings.warn(f"compiled kernels cannot be cached: {error}", RuntimeWarning, stacklevel=2)

    return save_or_warn


def kernel(function: Any) -> Any:
    """A serial kernel: element formulas, per-block work called from a parallel one."""
    return _compiled(function)


def parallel_kernel(function: Any) -> Any:
    """A kernel with `prange` loops over blocks."""
    return _compiled(function, parallel=True)


def inlined(function: Any) -> Any:
    """A piece of a kernel, written apart to be read apart: it has no machine code of its own, which would be compiled again in
    every kernel that calls it."""
    return njit(inline="always", nogil=True, error_model="numpy", fastmath=_FLAGS)(function)
