"""How kernels are compiled: once per machine, cached beside their source, releasing the GIL.

Every numba function of the project is made by one of the decorators here, so that one place decides the flags. `nnan` and
`ninf` stay off because a NaN of a user function is an error we report, and `reassoc` because range reductions and interval
rounding depend on the order in which they are written.

Numba's cache notices a change only in the file of the function itself, not in what that function calls; after an edit or an
upgrade it would run stale machine code. Here a cached kernel is valid for one state of its file and of all the files with
kernels that this one imports, directly or through others.
"""

from __future__ import annotations

import hashlib
import re
import warnings
from functools import cache
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import IndexDataCacheFile

_FLAGS = {"contract", "nsz", "arcp"}


_IMPORT = re.compile(rb"^from (\.+)([\w.]*) import (.*)", re.MULTILINE)


@cache
def _sources(path: Path) -> frozenset[Path]:
    """A file and those that it imports, as far as they hold kernels."""
    found, waiting = set(), [path]
    while waiting:
        file = waiting.pop()
        if file in found:
            continue
        text = file.read_bytes() if file.is_file() else b""
        if b"jit import" not in text and file.name != "jit.py":
            continue
        found.add(file)
        for dots, module, names in _IMPORT.findall(text):
            folder = file.parents[len(dots) - 1]
            parts = module.decode().split(".") if module else []
            waiting.append(folder.joinpath(*parts).with_suffix(".py") if parts else folder / "__init__.py")
            # `from . import a, b as c`: the names are modules.
            waiting += [
                folder.joinpath(*parts, name.split()[0] + ".py") for name in names.decode().split(",") if name.split()
            ]
    return frozenset(found)


@cache
def _stamp(path: Path) -> str:
    """What identifies the state of the sources of a file's kernels."""
    digest = hashlib.blake2b(digest_size=16)
    for file in sorted(_sources(path)):
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _compiled(function: Any, **options: Any) -> Any:
    dispatcher = njit(cache=True, nogil=True, error_model="numpy", fastmath=_FLAGS, **options)(function)
    held = getattr(dispatcher, "_cache", None)
    implementation = getattr(held, "_impl", None)
    if held is not None and implementation is not None:
        held._cache_file = IndexDataCacheFile(
            cache_path=held._cache_path,
            filename_base=implementation.filename_base,
            source_stamp=_stamp(Path(function.__code__.co_filename)),
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
