"""Pictures of meshes, drawn off screen: no display, no window, no graphics card needed.

Promises: the same mesh gives the same picture on one machine, exactly without `occlusion`, and with it to a few grey
levels in a few pixels (a software driver's ambient occlusion differs from run to run); memory is bounded by what the eye
can see, not by the mesh. Does not promise to draw faces of a large mesh that lie just behind others.
"""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frep.errors import ArgumentError, ArgumentTypeError, EmptyError, FileError
from frep.io.atomic import check_target, replacing
from frep.progress import progress

if TYPE_CHECKING:
    from frep.mesh import Mesh

THREE_QUARTER = (math.radians(-58.0), math.radians(27.0))
"""The view called "iso": from the right front above. Not isometric to the degree, where the cells of a cubic lattice
line up with the eye and the part looks like wallpaper."""

_HIDDEN_ABOVE = 1_000_000  # faces beyond which it pays to leave out those that others hide
_CHUNK = 1_000_000  # faces at a time: bounds the temporary arrays to about 100 MB
_MARGIN = 0.04  # room round the part, as a part of the picture


def render(
    mesh: Mesh,
    path: str | os.PathLike[str],
    *,
    size: tuple[int, int] = (1200, 900),
    view: str | tuple[float, float] = "iso",
    color: str | tuple[float, float, float] = "#8fa9bf",
    title: str | None = None,
    occlusion: bool = True,
) -> None:
    """Draw a mesh into a PNG file, in parallel projection, filling the picture.

    Args:
        mesh: the triangles.
        path: the picture's file, ending in `.png`; an old one is replaced only by a complete new one.
        size: width and height in pixels.
        view: "iso" for a three-quarter view from the right front above, or (azimuth, elevation) in radians of the eye:
            azimuth 0 looks from +x and pi/2 from +y, elevation pi/2 looks straight down on z.
        color: the part's colour, a name, "#rrggbb" or three numbers from 0 to 1.
        title: a line of text in the upper left corner.
        occlusion: whether openings darken with depth, by which the eye reads a lattice. Switch it off for pictures that
            are compared with one another: it is not the same to the last grey level from run to run.

    Raises:
        ArgumentError: a size that is not positive, an unknown view or colour.
        ArgumentTypeError: `mesh` is not a Mesh.
        EmptyError: the mesh has no face.
        FileError: not a `.png`, no such folder, not writable, no space.
    """
    from frep.mesh import Mesh

    if not isinstance(mesh, Mesh):
        raise ArgumentTypeError(f"mesh: expected a frep.Mesh, got {type(mesh).__name__}")
    check_picture(path)
    if len(size) != 2 or not all(isinstance(n, int) and 0 < n <= 16384 for n in size):
        raise ArgumentError(f"size: expected two whole numbers of pixels from 1 to 16384, got {size!r}")
    azimuth, elevation = _eye(view)
    if not mesh.n_faces:
        raise EmptyError("mesh: it has no faces, therefore there is nothing to draw")

    with progress("rendering"):
        picture = _draw(mesh, size, azimuth, elevation, color, title, occlusion)
        from PIL import Image

        with replacing(path) as temporary:
            Image.fromarray(picture).save(temporary, format="PNG", optimize=True)


def check_picture(path: str | os.PathLike[str]) -> None:
    """Say now, before the work, whether `render` can write at `path`.

    Raises:
        FileError: not a `.png`, no such folder, not writable.
    """
    if Path(path).suffix.lower() != ".png":
        raise FileError(f"path: a picture is written as .png, got {os.fspath(path)!r}")
    check_target(path)


def _eye(view: Any) -> tuple[float, float]:
    if view == "iso":
        return THREE_QUARTER
    try:
        azimuth, elevation = (float(angle) for angle in view)
    except (TypeError, ValueError):
        azimuth = elevation = math.nan
    if not (math.isfinite(azimuth) and abs(elevation) <= math.pi / 2 + 1e-9):
        raise ArgumentError(
            "view: expected 'iso' or (azimuth, elevation) in radians with an elevation from -pi/2 to pi/2, "
            f"got {view!r}"
        )
    return azimuth, elevation


def _frame(azimuth: float, elevation: float) -> np.ndarray:
    """Rows: the directions of the picture's right, of its top, and towards the eye."""
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    return np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]])


def _draw(
    mesh: Mesh,
    size: tuple[int, int],
    azimuth: float,
    elevation: float,
    color: Any,
    title: str | None,
    occlusion: bool,
) -> np.ndarray:
    import pyvista as pv

    try:
        color = pv.Color(color)
    except (TypeError, ValueError) as error:
        raise ArgumentError(
            f"color: expected a colour's name, '#rrggbb' or three numbers from 0 to 1, got {color!r}"
        ) from error

    frame = _frame(azimuth, elevation)
    corner = mesh.bounds[0]
    seen = (mesh.vertices - corner).astype(np.float32) @ frame.T.astype(np.float32)
    lower, upper = seen.min(axis=0), seen.max(axis=0)
    # Half the height of the picture in mm, so that both directions fit.
    width, height = (upper - lower)[:2] / (1.0 - 2.0 * _MARGIN)
    half = 0.5 * max(float(height), float(width) * size[1] / size[0], 1e-12)
    faces = mesh.faces
    if len(faces) > _HIDDEN_ABOVE:
        # Two layers: through slits narrower than a pixel the eye sees what lies behind.
        front = _visible(seen - lower, faces, 2.0 * half / size[1])
        behind = faces[~front]
        second = _visible(seen - lower, behind, 2.0 * half / size[1]) if len(behind) else front[:0]
        faces = np.concatenate([faces[front], behind[second]])
        used = np.zeros(len(seen), bool)
        used[faces.reshape(-1)] = True
        faces = (np.cumsum(used, dtype=np.int32) - 1)[faces]
        seen = seen[used]
    surface = pv.PolyData.from_regular_faces(seen - 0.5 * (lower + upper), faces)
    del seen, faces
    # Creases stay sharp, everything else is shaded smooth: a marched surface shows its shape and not its triangles.
    shaded: Any = surface.compute_normals(
        cell_normals=False, split_vertices=True, feature_angle=40.0, consistent_normals=False
    )

    with _quiet():
        # The part is drawn in the frame of the picture, so the eye and the lights never move.
        plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="none")
        try:
            plotter.set_background("#e4e8ec", top="#fbfcfd")  # pyright: ignore[reportArgumentType]
            for direction, strength in (((-0.5, 0.8, 1.0), 0.80), ((0.9, 0.1, 0.8), 0.42), ((0.0, -0.9, 0.5), 0.18)):
                plotter.add_light(pv.Light(position=direction, light_type="scene light", intensity=strength))
            plotter.add_mesh(shaded, color=color, ambient=0.2, diffuse=0.95, specular=0.12, specular_power=12)
            font = max(8, size[1] // 70)
            if title:
                plotter.add_text(title, position=(2 * font, size[1] - 4 * font), font_size=font, color="#2b3640")
            depth = float(upper[2] - lower[2])
            # A title has a line of its own, and the part all that is below.
            line = 4.5 * font / size[1] if title else 0.0
            lift = half * line / (1.0 - line)
            plotter.camera.position = (0.0, lift, depth + half)
            plotter.camera.focal_point = (0.0, lift, 0.0)
            plotter.camera.up = (0.0, 1.0, 0.0)
            plotter.camera.parallel_projection = True
            plotter.camera.parallel_scale = half + lift
            plotter.camera.clipping_range = (0.4 * depth + 0.9 * half, 1.6 * depth + 1.1 * half)
            # The eye reads a lattice by the dark of its openings more than by its shading.
            if occlusion:
                plotter.enable_ssao(radius=0.12 * half, bias=0.004 * half, kernel_size=32, blur=True)  # pyright: ignore[reportCallIssue]
            plotter.enable_anti_aliasing("ssaa")
            return np.asarray(plotter.screenshot(return_img=True))
        finally:
            plotter.close()


def _visible(seen: np.ndarray, faces: np.ndarray, pixel: float) -> np.ndarray:
    """Which faces do not lie well behind others.

    A lattice hides most of itself: of the 46 M faces of a gyroid block one in twelve is left. Depths are gathered in
    tiles of a pixel from the faces' centres; a face stays unless it lies behind the nearest centre of its tile and of all
    24 tiles round it by more than a few tiles. Tiles without a centre hide nothing, so that few, large faces stay; and
    what is seen through a slit of a pixel stays for the tile of that pixel.

    Args:
        seen: (n, 3) vertices in the picture's frame, from 0 upward, larger third coordinate nearer to the eye.
        faces: (m, 3) their faces.
        pixel: mm a pixel.
    """
    from scipy.ndimage import minimum_filter

    tile = pixel
    shape = tuple(np.ceil(seen.max(axis=0)[:2] / tile).astype(int) + 1)
    nearest = np.full(shape[0] * shape[1], -np.inf, np.float32)
    cells = np.empty(len(faces), np.int32)
    tops = np.empty(len(faces), np.float32)
    for start in range(0, len(faces), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        a, b, c = (seen[faces[chunk, k]] for k in range(3))
        centre = (a + b + c) / 3.0
        i, j = (centre[:, :2] / tile).astype(np.int32).T
        cells[chunk] = i * np.int32(shape[1]) + j
        tops[chunk] = np.maximum(np.maximum(a[:, 2], b[:, 2]), c[:, 2])
        np.maximum.at(nearest, cells[chunk], centre[:, 2])
    # The farthest of the nine nearest depths: a tile that a silhouette crosses hides nothing it should not.
    horizon = minimum_filter(nearest.reshape(shape), size=5, mode="constant", cval=-np.inf).reshape(-1) - 4.0 * tile
    return tops >= horizon[cells]


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep VTK from telling that there is no X server: it goes on to EGL or OSMesa by itself, which is what we want."""
    from vtkmodules.vtkCommonCore import vtkLogger

    empty_display = os.environ.get("DISPLAY") == ""
    if empty_display:
        del os.environ["DISPLAY"]
    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)
        if empty_display:
            os.environ["DISPLAY"] = ""
