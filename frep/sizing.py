"""Voxels against features: is the grid fine enough, which voxel does a tolerance need, and are all widths positive."""

from __future__ import annotations

import math

import numpy as np

from .arguments import positive
from .errors import ArgumentError, EmptyError, FunctionError, ThinWallWarning, warn
from .grid import LEAF, SparseGrid
from .sampling import sample
from .solid import Feature, Solid, explain_empty, require_bounded

_SAFETY = 1.7
"""The largest facet of a finer grid, and the middles of its edges, are farther off than the trial's 99th percentile."""

_DEFAULT_TOLERANCE = 1e-3
"""Of the longest side, where neither voxel nor tolerance is given."""


def sample_solid(
    solid: Solid,
    voxel: float | None,
    tolerance: float | None,
    *,
    band: float = 0.0,
    exact: float = 1.0,
    extra_bytes: int = 0,
    quiet: bool = False,
) -> SparseGrid:
    """`Solid.sample`: validate, choose the voxel, sample, and look at the widths."""
    size = chosen_voxel(solid, voxel, tolerance)
    _require_positive_widths(solid)
    try:
        grid = sample(solid.field, solid.bounds, size, band=band, exact=exact, extra_bytes=extra_bytes)
    except FunctionError as error:
        if error.point is None:
            raise
        raise FunctionError(_explain_nan(solid, np.array([error.point]))) from error
    except EmptyError:
        raise EmptyError(explain_empty(solid, lambda part: _is_empty(part, solid.bounds, size))) from None
    if not quiet:
        _warn_of_thin(solid, grid)
    return grid


def _explain_nan(solid: Solid, point: np.ndarray) -> str:
    """Which width or part is not a number at a point, for the message of a FunctionError."""
    where = f"not a number (NaN) at ({', '.join(f'{v:.6g}' for v in point[0])})"
    for feature in solid.features:
        if np.isnan(feature.width(point)[0]):
            return f"{feature.argument}: {feature.width!r} is {where}"
    part = solid
    while True:
        guilty = [p for p in part._provenance.operands if np.isnan(p.field(point)[0])]
        if not guilty:
            return f"the field of the part {part._provenance.label!r}, {part.field!r}, is {where}"
        part = guilty[0]


def chosen_voxel(solid: Solid, voxel: float | None, tolerance: float | None) -> float:
    """The voxel size given, or the one that a chord tolerance needs."""
    require_bounded(solid)
    if voxel is not None:
        if tolerance is not None:
            raise ArgumentError("voxel, tolerance: give one of them, not both")
        return positive(voxel, "voxel")
    if tolerance is None:
        return voxel_for(solid, _DEFAULT_TOLERANCE * float(np.ptp(solid.bounds, axis=0).max()))
    return voxel_for(solid, positive(tolerance, "tolerance"))


def voxel_for(solid: Solid, tolerance: float) -> float:
    """The voxel at which flat facets keep within `tolerance` mm of the surface.

    A trial mesh tells the sag of its facets, which falls with the square of the voxel; its 99th percentile is held against
    the tolerance, so that sharp edges, where no voxel suffices, do not decide. Never coarser than half the thinnest width.
    """
    from .meshing.mesher import trial_sag

    require_bounded(solid)
    longest = float(np.ptp(solid.bounds, axis=0).max())
    thinnest = min((_least_width(f, solid.bounds) for f in solid.features), default=math.inf)
    trial = min(longest / 48.0, thinnest / 2.5)
    limit = min(longest / 16.0, thinnest / 2.0)
    wanted = limit
    for _ in range(3):
        sag = trial_sag(solid, trial)
        wanted = limit if sag <= 0.0 else min(trial * math.sqrt(tolerance / (_SAFETY * sag)), limit)
        if wanted > 0.7 * trial:
            break
        trial = max(wanted, trial / 3.0)
    return float(wanted)


def _least_width(feature: Feature, bounds: np.ndarray) -> float:
    if feature.width.is_constant:
        return feature.width.data
    return float(feature.width(_scatter(bounds)).min())


def _scatter(bounds: np.ndarray, n: int = 17) -> np.ndarray:
    axes = [np.linspace(bounds[0, a], bounds[1, a], n) for a in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _require_positive_widths(solid: Solid) -> None:
    """A width that is zero or less somewhere is an error that names the place; only where bounds cannot rule it out."""
    for feature in solid.features:
        low, high = feature.width.bounds(*solid.bounds)
        if low > 0.0 and math.isfinite(high):
            continue
        points = _scatter(solid.bounds)
        # Material is only asked for inside the part; outside it a law may do what it likes.
        points = points[solid.field(points) < 0.5 * float(np.ptp(solid.bounds, axis=0).max()) / 16.0]
        if len(points):
            _require_positive(feature, points)


def _require_positive(feature: Feature, points: np.ndarray) -> None:
    values = feature.width(points)
    bad = np.flatnonzero(~((values > 0.0) & np.isfinite(values)))
    if len(bad):
        where = ", ".join(f"{v:.4g}" for v in points[bad[0]])
        raise ArgumentError(
            f"{feature.argument}: every {feature.what} must be more than 0 mm wide, and finite; {feature.width!r} is "
            f"{values[bad[0]]:.4g} mm at ({where})"
        )


def _warn_of_thin(solid: Solid, grid: SparseGrid) -> None:
    if not solid.features or not len(grid.leaves):
        return
    limit = 2.0 * grid.voxel * (1.0 - 1e-9)
    thinnest, what = math.inf, ""
    for feature in solid.features:
        width = feature.width.data if feature.width.is_constant else _least_below(feature, solid, grid, limit)
        if width < thinnest:
            thinnest, what = width, feature.what
    if thinnest < limit:
        warn(
            f"the thinnest {what} is {thinnest:.4g} mm, less than two voxels of {grid.voxel:.4g} mm: it may be torn; "
            f"a voxel of {0.5 * thinnest:.3g} mm resolves it",
            ThinWallWarning,
        )


def _least_below(feature: Feature, solid: Solid, grid: SparseGrid, limit: float) -> float:
    """The least width that a law has near the surface, mm, if it is below a limit; otherwise infinity."""
    asked = np.arange(len(grid.leaves))
    if len(asked) > _ASKED:
        # Not every so many: leaves come in rows, and a law may keep step with them.
        asked = np.random.default_rng(0).choice(asked, _ASKED, replace=False)
    lo = np.clip(grid.origin + grid.voxel * LEAF * grid.leaves[asked], *solid.bounds)
    hi = np.clip(lo + grid.voxel * (LEAF - 1), *solid.bounds)
    low = np.asarray(feature.width.bounds(lo, hi)[0])
    # Most parts have none: samples are looked at last, there are 512 to a leaf.
    thin = np.flatnonzero(~(low >= limit))
    thin = thin[np.any(np.abs(grid.values[asked[thin]]) < 2 * grid.voxel, axis=(1, 2, 3))]
    if not len(thin):
        return math.inf
    middle = 0.5 * (lo[thin] + hi[thin])
    _require_positive(feature, middle)
    width = float(np.min(low[thin]))
    # Bounds that know nothing (a function without a Lipschitz bound): what was seen.
    return width if width > 0.0 else float(feature.width(middle).min())


_ASKED = 50_000
"""The most leaves at which varying widths are looked at; bounds of a law cost some 50 ns a leaf."""


def _is_empty(part: Solid, bounds: np.ndarray, voxel: float) -> bool:
    lo, hi = np.maximum(part.bounds[0], bounds[0]), np.minimum(part.bounds[1], bounds[1])
    if np.any(lo >= hi):
        return True
    coarse = max(voxel, float(np.max(hi - lo)) / 200.0)
    try:
        sample(Solid(part.field, (lo, hi)).field, np.array([lo, hi]), coarse)
    except EmptyError:
        return True
    return False
