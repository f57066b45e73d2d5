"""How kernels are compiled: once per machine, cached beside their source, releasing the GIL.

Every numba function of the project is made by one of the decorators here, so that one place decides the flags. `nnan` and
`ninf` stay off because a NaN of a user function is an error we report, and `reassoc` because range reductions and interval
rounding depend on the order in which they are written.
"""

from __future__ import annotations

from numba import njit

_FLAGS = {"contract", "nsz", "arcp"}

kernel = njit(cache=True, nogil=True, error_model="numpy", fastmath=_FLAGS)
"""A serial kernel: element formulas, per-block work called from a parallel one."""

parallel_kernel = njit(cache=True, nogil=True, error_model="numpy", fastmath=_FLAGS, parallel=True)
"""A kernel with `prange` loops over blocks."""
