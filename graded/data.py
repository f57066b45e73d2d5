"""Fields from data: images and CT volumes, grids, scattered points, the distance to a body (`mesh_data`: finite
elements).

Data becomes a trilinear grid (`frep.sampled`), which costs a lookup and has true bounds, so that regions without
surface are skipped. Outside its box a field of data keeps the value at the nearest point of the box. Positions are mm;
values keep the unit of the data (`remap` turns them into mm of a parameter).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from frep import ArgumentError, ArgumentTypeError, Field, FileError, Solid, SparseGrid, TooLargeError, clip
from frep import coordinates as position
from frep.arguments import box_of, real, sizes, suggestion, vector

_MOST_NODES = 4 * 10**8


def distance_to(solid: Solid) -> Field:
    """Distance to the surface of a solid, mm, positive on both sides.

    Exact where the solid's field is an exact distance (primitives, loaded bodies), a lower bound elsewhere.

    Example:
        >>> import frep
        >>> distance_to(frep.sphere((0, 0, 0), 5))([[0, 0, 0], [0, 0, 7]])
        array([5., 2.])
    """
    if not isinstance(solid, Solid):
        raise ArgumentTypeError(f"solid: expected a Solid, got {type(solid).__name__}: {solid!r}")
    return abs(solid.field)


# --- images and grids --------------------------------------------------------------------------------------------


def from_grid(
    values: Any,
    spacing: Any = None,
    origin: Any = (0.0, 0.0, 0.0),
    *,
    periodic: bool = False,
    nan: float | str | None = None,
) -> Field:
    """Numbers on a grid, interpolated trilinearly.

    Args:
        values: (nx, ny, nz) numbers, `values[i, j, k]` at `origin + spacing * (i, j, k)`, kept as float32 (masked ones
            are NaN); or a `frep.SparseGrid`; or the path of a `.vdb` file, whose first level set is read. A level set
            ends at plus or minus its background.
        spacing: distance of the numbers in mm, one or three; a SparseGrid and a file have their own.
        origin: position of `values[0, 0, 0]`, mm.
        periodic: repeat the grid every `spacing * (nx, ny, nz)` instead of continuing its outermost values.
        nan: what to put in place of NaN: "nearest" (the value of the nearest number) or a number; None to refuse it.

    Raises:
        ArgumentTypeError: no real numbers.
        ArgumentError: no spacing; NaN or infinite values, with their count and the first place; another number of axes;
            a spacing, origin or period for a level set, which has its own.
        FileError: the file cannot be read.

    Example:
        >>> import numpy as np
        >>> ramp = from_grid(np.arange(3.0).reshape(3, 1, 1), spacing=10)
        >>> ramp([[-5, 0, 0], [5, 3, 0], [20, 0, 0]])
        array([0. , 0.5, 2. ])
    """
    nan = checked_nan(nan)
    if isinstance(values, str | os.PathLike | SparseGrid) and (spacing is not None or periodic or np.any(origin)):
        name = "spacing" if spacing is not None else "periodic" if periodic else "origin"
        raise ArgumentError(f"{name}: a level set has its own, in mm; none can be given here")
    if isinstance(values, str | os.PathLike):
        from frep.io.vdb import read_vdb

        values = read_vdb(values)
    if isinstance(values, SparseGrid):
        return grid_field(values.dense(), np.full(3, values.voxel), values.origin, nan=nan, label="grid")
    array = _volume(values)
    step = _spacing(spacing)
    return grid_field(array, step, vector(origin, "origin"), nan=nan, periodic=periodic, label="grid")


def from_image(
    image: Any,
    array: str | None = None,
    *,
    spacing: Any = None,
    origin: Any = None,
    axes: str = "xyz",
    nan: float | str | None = None,
) -> Field:
    """An image stack or a CT volume, interpolated between the centres of its voxels.

    Args:
        image: an array of shape (nx, ny, nz); or the path of an image with its own spacing (`.vti`, `.mha`, `.nrrd`,
            `.dcm` ...), or a pyvista ImageData; or a list of paths of equal pictures (`.png`, `.tif` ...), the slices
            along z, or of one. Rows run along y from the first, columns along x.
        array: which array of the file; not needed where there is one.
        spacing: distance of the voxels in mm, one number or three (x, y, z); a file may have its own, which this
            replaces.
        origin: centre of the first voxel, mm; a file's own, or (0, 0, 0). The axes of a file that says how they are
            turned (its direction matrix) stay turned.
        axes: "xyz" for `image[x, y, z]`, "zyx" for `image[slice, row, column]` (pictures are read so).
        nan: as for `from_grid`.

    Returns:
        The values in the unit of the data (Hounsfield units, grey levels).

    Raises:
        ArgumentError: no spacing, an array that is not there, NaN (with their count and the first place).
        FileError: a file that is missing or is no image.

    Example:
        >>> import numpy as np
        >>> stack = np.zeros((2, 4, 4))  # two slices
        >>> stack[1] = 100
        >>> from_image(stack, spacing=(0.5, 0.5, 3), axes="zyx")([[1, 1, 1.5]])
        array([50.])
    """
    if axes not in ("xyz", "zyx"):
        raise ArgumentError(f'axes: expected "xyz" or "zyx", got {axes!r}')
    nan, label, turned = checked_nan(nan), "image", np.eye(3)
    if isinstance(image, str | os.PathLike):
        label = Path(image).name
        if Path(image).suffix.lower() in _FLAT:
            # What VTK would read with a spacing of 1 that nobody gave, and upside down.
            image, axes = _pictures([image], pages=True), "zyx"
        else:
            image = dataset(image, "image")
    if hasattr(image, "point_data"):
        image, own_spacing, own_origin, first, turned = _image_data(image, array)
        spacing = own_spacing if spacing is None else spacing
        origin = own_origin + turned @ (_spacing(spacing) * first) if origin is None else origin
        axes = "xyz"
    elif array is not None:
        raise ArgumentError(f"array: only a file or a dataset has arrays with names, got {array!r}")
    elif isinstance(image, Sequence) and len(image) and all(isinstance(s, str | os.PathLike) for s in image):
        image, axes = _pictures(image), "zyx"
    volume = _volume(image, "image")
    if axes == "zyx":
        volume = volume.transpose(2, 1, 0)
    start = np.zeros(3) if origin is None else vector(origin, "origin")
    return grid_field(volume, _spacing(spacing), start, nan=nan, label=label, name="image", turned=turned)


_FLAT = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pnm", ".pgm", ".ppm")
"""Pictures, which have pixels and no mm."""


def _spacing(spacing: Any) -> np.ndarray:
    if spacing is None:
        raise ArgumentError("spacing: the data does not say how far apart its values are; give mm, one number or three")
    return sizes(spacing, "spacing")


def _volume(values: Any, name: str = "values") -> np.ndarray:
    if isinstance(values, np.ma.MaskedArray):
        values = np.ma.filled(values.astype(float), np.nan)
    try:
        raw = np.asarray(values)
        if raw.dtype.kind not in "biufO":
            raise TypeError("no real numbers")
        array = single_precision(raw, name)
    except (TypeError, ValueError) as error:
        if isinstance(error, ArgumentError):
            raise
        raise ArgumentTypeError(
            f"{name}: expected an (nx, ny, nz) array of real numbers, got {type(values).__name__}"
        ) from None
    if array.ndim != 3 or min(array.shape) < 1:
        raise ArgumentError(f"{name}: expected an array with three axes, got shape {array.shape}")
    return array


def single_precision(values: np.ndarray, name: str) -> np.ndarray:
    """As float32, as which grids are kept."""
    with np.errstate(over="ignore"):
        array = np.asarray(values, dtype=np.float32)
    if array is not values and values.dtype.itemsize > 4:
        lost = np.isinf(array) & np.isfinite(values.astype(float))
        if lost.any():
            raise ArgumentError(
                f"{name}: {int(lost.sum()):,} of {lost.size:,} values are beyond 3.4e38, the most that a grid holds"
            )
    return array


def checked_nan(nan: Any) -> float | str | None:
    """What is to be put in place of NaN: None, "nearest" or a number, checked before there is any."""
    if isinstance(nan, str) and nan != "nearest":
        raise ArgumentError(f'nan: expected None, "nearest" or a number, got {nan!r}{suggestion(nan, ["nearest"])}')
    return nan if nan is None or isinstance(nan, str) else real(nan, "nan", "the unit of the data")


def _pictures(paths: Sequence[Any], *, pages: bool = False) -> np.ndarray:
    """(slices, rows, columns) grey values; `pages`: of one file, which may hold a stack of slices."""
    import tifffile
    from skimage.io import imread

    slices = []
    for path in paths:
        if not Path(path).is_file():
            raise FileError(f"image: there is no file {os.fspath(path)!r}")
        try:
            # A stack of three or four pages scikit-image takes for a picture in colours.
            read = tifffile.imread if pages and Path(path).suffix.lower() in (".tif", ".tiff") else imread
            picture = np.asarray(read(path), dtype=np.float32)
        except Exception as error:
            raise FileError(f"image: cannot read {os.fspath(path)!r}: {error}") from error
        if pages and picture.ndim == 3 and picture.shape[2] > 4:
            return picture
        if picture.ndim == 3 and picture.shape[2] <= 4:
            # Colours, and perhaps how opaque they are, after them.
            picture = picture[..., : 3 if picture.shape[2] >= 3 else 1].mean(axis=2)
        if picture.ndim != 2:
            raise ArgumentError(
                f"image: {os.fspath(path)!r} holds pages of shape {picture.shape}, no slice; give its pages as an array"
            )
        slices.append(picture)
    if len({s.shape for s in slices}) > 1:
        raise ArgumentError(f"image: the slices differ in size: {sorted({s.shape for s in slices})}")
    return np.stack(slices)


def _image_data(image: Any, array: str | None) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Of a pyvista ImageData: values, spacing, origin, the index of the first value, (3, 3) directions of its axes.

    A value lies at `origin + directions @ (spacing * index)`; those of voxels at the centres of cells. A piece of a
    larger image has the index of its place in that.
    """
    if not hasattr(image, "dimensions") or not hasattr(image, "spacing"):
        raise ArgumentError(
            f"image: expected an image with a spacing, got a {type(image).__name__}; use from_mesh_data"
        )
    values, association = array_of(image, array)
    spacing, origin = np.asarray(image.spacing, float), np.asarray(image.origin, float)
    # A slice has no spacing across.
    spacing = np.where(spacing > 0, spacing, 1.0)
    shape = tuple(np.asarray(image.dimensions))
    first = np.asarray(image.extent, float)[::2]
    if association == "cell":
        shape = tuple(max(n - 1, 1) for n in shape)
        first = first + 0.5
    if values.ndim != 1:
        raise ArgumentError(f"array: {array!r} holds {values.shape[1]} numbers a voxel, expected one")
    # VTK counts x fastest.
    turned = np.asarray(getattr(image, "direction_matrix", np.eye(3)), float)
    return values.reshape(shape, order="F"), spacing, origin, first, turned


def dataset(path: Any, name: str) -> Any:
    import pyvista

    if not Path(path).is_file():
        raise FileError(f"{name}: there is no file {os.fspath(path)!r}")
    try:
        data = pyvista.read(path)
    except Exception as error:
        raise FileError(f"{name}: cannot read {os.fspath(path)!r}: {error}") from error
    # VTK complains of a broken file on the console only, and gives what it has.
    if not isinstance(data, pyvista.MultiBlock) and getattr(data, "n_points", 0) == 0:
        raise FileError(f"{name}: cannot read {os.fspath(path)!r}: it holds no points; is it whole?")
    return data


def array_of(data: Any, array: str | None) -> tuple[np.ndarray, str]:
    """An array of a dataset by name, and whether its numbers belong to points or cells."""
    points, cells = list(data.point_data.keys()), list(data.cell_data.keys())
    there = ", ".join([*(f"{n!r} (points)" for n in points), *(f"{n!r} (cells)" for n in cells)])
    if not there:
        raise ArgumentError("array: the data holds no arrays, only a shape")
    if array is None:
        if len(points) + len(cells) != 1:
            raise ArgumentError(f"array: which one? There are: {there}")
        array = (points + cells)[0]
    if array not in points + cells:
        raise ArgumentError(f"array: there is no {array!r}; there are: {there}{suggestion(array, points + cells)}")
    association = "point" if array in points else "cell"
    held = data.point_data[array] if array in points else data.cell_data[array]
    try:
        # Copies: VTK frees the memory under a view with the dataset, whoever still reads it.
        return np.array(held, float), association
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"array: {array!r} holds no numbers, but {np.asarray(held).dtype}") from None


def lattice(bounds: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, tuple[int, int, int], np.ndarray, np.ndarray]:
    """Nodes that span a box, its faces included, at most `step` apart: points, shape, origin, spacing."""
    size = bounds[1] - bounds[0]
    cells = np.maximum(np.ceil(size / step - 1e-9), 1.0)
    if float(np.prod(cells + 1)) > _MOST_NODES:
        raise TooLargeError(
            f"spacing: a grid of {' x '.join(f'{c:.0f}' for c in cells + 1)} values is too large; take a wider spacing"
        )
    # A flat box still needs a cell across.
    spacing = np.where(size > 0, size / cells, step)
    shape = (int(cells[0]) + 1, int(cells[1]) + 1, int(cells[2]) + 1)
    axes = [bounds[0, a] + spacing[a] * np.arange(shape[a]) for a in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return nodes, shape, bounds[0].astype(float), spacing


def grid_field(
    values: np.ndarray,
    spacing: np.ndarray,
    origin: np.ndarray,
    *,
    nan: float | str | None,
    periodic: bool = False,
    label: str,
    name: str = "values",
    turned: np.ndarray | None = None,
) -> Field:
    """The Field of a grid, NaN replaced, at least two nodes along each axis, constant beyond its box.

    `turned` holds the directions of its axes in its columns, where they are not those of space.
    """
    from frep.sampled import SampledGrid

    if turned is not None and not np.array_equal(turned, np.eye(3)):
        values = _without_nan(single_precision(values, name), spacing, origin, nan, name, turned)
        still = grid_field(values, spacing, np.zeros(3), nan=None, periodic=periodic, label=label)
        offsets = [p - float(o) for p, o in zip(position(), origin, strict=True)]
        # The inverse is the transpose where the directions are at right angles, as they nearly always are.
        rows = np.linalg.inv(turned).tolist()
        return still.substitute(*(offsets[0] * r[0] + offsets[1] * r[1] + offsets[2] * r[2] for r in rows))
    values = _without_nan(single_precision(values, name), spacing, origin, nan, name)
    extent = spacing * (np.array(values.shape) - 1)
    if periodic:
        values = np.pad(values, ((0, 1),) * 3, mode="wrap")
    else:
        values = np.pad(values, [(0, 1 if n == 1 else 0) for n in values.shape], mode="edge")
    grid = SampledGrid(origin, spacing, np.ascontiguousarray(values), periodic=periodic, label=label)
    if periodic:
        return grid.field()
    # A grid's own continuation has slope one, as a distance has; a parameter stays what it is.
    inside = [clip(c, float(o), float(o + e)) for c, o, e in zip(position(), origin, extent, strict=True)]
    return grid.field().substitute(*inside)


def _without_nan(
    values: np.ndarray,
    spacing: np.ndarray,
    origin: np.ndarray,
    nan: float | str | None,
    name: str,
    turned: np.ndarray | None = None,
) -> np.ndarray:
    bad = ~np.isfinite(values)
    if not bad.any():
        return values
    if nan is None:
        first = np.argwhere(bad)[0]
        away = spacing * first if turned is None else turned @ (spacing * first)
        place = ", ".join(f"{v:.6g}" for v in origin + away)
        raise ArgumentError(
            f"{name}: {int(bad.sum()):,} of {bad.size:,} values are NaN or infinite, the first at "
            f'[{", ".join(map(str, first))}], ({place}) mm; give nan="nearest" or a number to put in their place'
        )
    return filled(values, bad, spacing, nan)


def filled(values: np.ndarray, bad: np.ndarray, spacing: np.ndarray, nan: float | str) -> np.ndarray:
    """`values` with the bad ones replaced."""
    if nan == "nearest":
        from scipy.ndimage import distance_transform_edt

        if bad.all():
            raise ArgumentError(
                "nan: there is no number to take the nearest of; every value is NaN or outside the mesh"
            )
        nearest = np.asarray(distance_transform_edt(bad, sampling=spacing, return_distances=False, return_indices=True))
        return values[tuple(nearest)]
    return np.where(bad, np.float32(nan), values)


# --- scattered points ------------------------------------------------------------------------------------------


def from_points(
    points: Any,
    values: Any,
    method: str = "linear",
    *,
    spacing: Any = None,
    over: Any = None,
) -> Field:
    """Numbers at scattered points, interpolated onto a grid by scipy.

    Args:
        points: (n, 3) positions, mm. Of several at one place the mean counts.
        values: (n,) numbers.
        method: "nearest"; "linear" (in Delaunay tetrahedra; outside their hull the nearest value); "inverse distance"
            (Shepard 1968, of the eight nearest, weights 1 / d**2: never beyond the values); "rbf" (thin-plate spline of
            the 50 nearest: smooth, reproduces linear functions, may overshoot).
        spacing: of the grid, mm, one number or three; a 64th of the longest side unless given.
        over: the box to cover, a Solid or two corners in mm; that of the points unless given.

    Raises:
        ArgumentError: unknown method, NaN (with their count and the first place), too few points.

    Example:
        >>> corners = [(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10)]
        >>> float(from_points(corners, [0, 10, 0, 0])((2.5, 2.5, 2.5)).round(6))
        2.5
    """
    at, held = _scattered(points, values)
    box = np.array([at.min(axis=0), at.max(axis=0)]) if over is None else box_of(over)
    longest = float((box[1] - box[0]).max())
    if not longest > 0:
        raise ArgumentError("points: they all lie at one place; give over, the box to cover, in mm")
    step = np.full(3, longest / 64) if spacing is None else sizes(spacing, "spacing")
    interpolate = _interpolator(at, held, method)
    nodes, shape, origin, step = lattice(box, step)
    try:
        found = interpolate(nodes)
    except np.linalg.LinAlgError:
        raise ArgumentError(
            'points: "rbf" needs points that do not lie in one plane near any place; try "nearest"'
        ) from None
    return grid_field(found.reshape(shape), step, origin, nan=None, label="points")


def _scattered(points: Any, values: Any) -> tuple[np.ndarray, np.ndarray]:
    try:
        at, held = np.array(points, dtype=float), np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentTypeError("points, values: expected (n, 3) positions in mm and (n,) numbers") from None
    if at.ndim != 2 or at.shape[1] != 3 or len(at) == 0:
        raise ArgumentError(f"points: expected a non-empty (n, 3) array, got shape {at.shape}")
    if held.shape != (len(at),):
        raise ArgumentError(f"values: expected {len(at)} numbers, one a point, got shape {held.shape}")
    for name, array in (("points", at), ("values", held[:, None])):
        bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
        if len(bad):
            raise ArgumentError(f"{name}: {len(bad):,} of {len(at):,} are NaN or infinite, the first at row {bad[0]}")
    places, owner = np.unique(at, axis=0, return_inverse=True)
    if len(places) < len(at):
        owner = owner.reshape(-1)
        return places, np.bincount(owner, held) / np.bincount(owner)
    return at, held


def _interpolator(at: np.ndarray, held: np.ndarray, method: str) -> Callable[[np.ndarray], np.ndarray]:
    from scipy.interpolate import LinearNDInterpolator, RBFInterpolator
    from scipy.spatial import KDTree, QhullError

    if method == "rbf":
        try:
            return RBFInterpolator(at, held, neighbors=min(50, len(at)))
        except (ValueError, np.linalg.LinAlgError) as error:
            raise ArgumentError(f"points: no thin-plate spline through them: {error}") from error
    tree = KDTree(at)
    if method == "nearest":
        return lambda p: held[tree.query(p)[1]]
    if method == "inverse distance":
        count = min(8, len(at))

        def shepard(p: np.ndarray) -> np.ndarray:
            distance, index = tree.query(p, k=list(range(1, count + 1)))  # type: ignore[arg-type]
            weight = 1.0 / np.maximum(distance, 1e-12) ** 2
            return (weight * held[index]).sum(axis=1) / weight.sum(axis=1)

        return shepard
    if method != "linear":
        known = ("nearest", "linear", "inverse distance", "rbf")
        raise ArgumentError(
            f'method: expected "nearest", "linear", "inverse distance" or "rbf", got {method!r}{suggestion(method, known)}'
        )
    try:
        inside = LinearNDInterpolator(at, held)
    except (QhullError, ValueError) as error:
        raise ArgumentError(
            'points: "linear" needs four points that do not lie in one plane; try "nearest" or "inverse distance"'
        ) from error

    def linear(p: np.ndarray) -> np.ndarray:
        found = np.asarray(inside(p), float)
        outside = np.isnan(found)
        found[outside] = held[tree.query(p[outside])[1]]
        return found

    return linear
