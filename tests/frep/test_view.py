"""Pictures: the same twice, what is nearer hides what is farther, nothing half-written, no display needed."""

from __future__ import annotations

import math
import os
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import frep.view
from frep.errors import ArgumentError, ArgumentTypeError, EmptyError, FileError
from frep.mesh import Mesh
from frep.view import render

SMALL = (240, 180)


def box(lo, hi) -> Mesh:
    lo, hi = np.asarray(lo, float), np.asarray(hi, float)
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))]
    return Mesh(lo + corners * (hi - lo), np.array(faces))


def joined(*meshes: Mesh) -> Mesh:
    shifts = np.cumsum([0, *(len(m.vertices) for m in meshes[:-1])])
    faces = np.vstack([m.faces + shift for m, shift in zip(meshes, shifts, strict=True)])
    return Mesh(np.vstack([m.vertices for m in meshes]), faces)


def refined(n: int) -> Mesh:
    """Two concentric spheres of about 2 n^2 faces each; the inner one cannot be seen."""
    theta, phi = np.meshgrid(np.linspace(0, math.pi, n), np.linspace(0, 2 * math.pi, 2 * n), indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    at = np.arange(n * 2 * n).reshape(n, 2 * n)
    a, b, c, d = (q.reshape(-1) for q in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]))
    faces = np.vstack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return joined(Mesh(10 * points, faces), Mesh(7 * points, faces))


def picture(mesh: Mesh, path, **options) -> np.ndarray:
    render(mesh, path, size=SMALL, **options)
    return np.asarray(Image.open(path).convert("RGB"), dtype=np.int16)


def differ(a: np.ndarray, b: np.ndarray) -> float:
    """Mean difference in grey levels."""
    return float(np.abs(a - b).mean())


def test_same_mesh_same_picture(tmp_path):
    mesh = refined(20)
    assert differ(picture(mesh, tmp_path / "a.png"), picture(mesh, tmp_path / "b.png")) < 0.5


def test_without_occlusion_pictures_are_equal_to_the_last_grey_level(tmp_path):
    """Many small openings: with occlusion, a software driver draws them a little differently from run to run."""
    slats = joined(*(box((i, j, 0), (i + 0.6, j + 0.6, 3 * (i % 3))) for i in range(12) for j in range(12)))
    first, *others = (picture(slats, tmp_path / f"{n}.png", occlusion=False) for n in range(3))
    assert all(np.array_equal(first, other) for other in others)


def test_moving_or_scaling_the_part_changes_nothing(tmp_path):
    """The part fills the picture wherever it is and however large, 1 km from the origin too."""
    mesh = refined(20)
    first = picture(mesh, tmp_path / "a.png")
    moved = picture(Mesh(4 * mesh.vertices + [1e6, -1e6, 3e5], mesh.faces), tmp_path / "b.png")
    assert differ(first, moved) < 0.5


@pytest.mark.parametrize(
    ("view", "width", "height"),
    [((0.0, 0.0), 2.0, 1.0), ((math.pi / 2, 0.0), 4.0, 1.0), ((-math.pi / 2, math.pi / 2), 4.0, 2.0)],
)
def test_outline_is_the_projection(tmp_path, view, width, height):
    """A 4 x 2 x 1 box seen along an axis is a rectangle of the other two sides, all of it inside the picture."""
    ground = picture(box((0, 0, 0), (1e-3, 1e-3, 1e-3)), tmp_path / "ground.png", view=view)
    drawn = picture(box((0, 0, 0), (4, 2, 1)), tmp_path / "box.png", view=view)
    rows, columns = np.nonzero((np.abs(drawn - ground[:, :1]) > 24).any(axis=2))
    assert (np.ptp(columns) + 1) / (np.ptp(rows) + 1) == pytest.approx(width / height, rel=0.03)
    assert 0 < rows.min() <= rows.max() < SMALL[1] - 1
    assert 0 < columns.min() <= columns.max() < SMALL[0] - 1


def test_right_is_right(tmp_path):
    """Seen from -y, +x is to the right and +z is up: a small box in that corner is drawn in that corner."""
    part = joined(box((0, 0, 0), (4, 1, 0.2)), box((3.5, 0, 2.5), (4, 1, 3)))
    drawn = picture(part, tmp_path / "a.png", view=(-math.pi / 2, 0.0))
    upper = drawn[: SMALL[1] // 2]
    _, columns = np.nonzero((np.abs(upper - upper[:, :1]) > 24).any(axis=2))
    assert columns.min() > SMALL[0] / 2


def test_leaving_out_hidden_faces_leaves_the_picture(tmp_path, monkeypatch):
    mesh = refined(400)
    whole = picture(mesh, tmp_path / "whole.png")
    monkeypatch.setattr(frep.view, "_HIDDEN_ABOVE", 0)
    kept = {}
    visible = frep.view._visible
    # The first call peels off the front layer.
    monkeypatch.setattr(
        frep.view, "_visible", lambda *a: kept.setdefault("front", visible(*a)) if not kept else visible(*a)
    )
    culled = picture(mesh, tmp_path / "culled.png")
    assert differ(whole, culled) < 0.3
    # The inner sphere and the far half of the outer one are 3/4 of all faces.
    assert np.count_nonzero(kept["front"]) < 0.4 * mesh.n_faces


def test_few_large_faces_hide_nothing_wrongly(tmp_path, monkeypatch):
    part = joined(box((0, 0, 0), (10, 10, 1)), box((2, 2, 5), (3, 3, 6)), box((0, 0, -8), (10, 10, -7)))
    whole = picture(part, tmp_path / "whole.png")
    monkeypatch.setattr(frep.view, "_HIDDEN_ABOVE", 0)
    assert differ(whole, picture(part, tmp_path / "culled.png")) < 0.5


def test_size_and_title(tmp_path):
    """A title has a line of its own: the part, red here, begins below it and is whole."""
    mesh = box((0, 0, 0), (1, 1, 1))
    plain = picture(mesh, tmp_path / "a.png", color="red", occlusion=False)
    titled = picture(mesh, tmp_path / "b.png", color="red", occlusion=False, title="cube")
    assert plain.shape == titled.shape == (SMALL[1], SMALL[0], 3)
    red = titled[..., 0] - titled[..., 1] > 30
    ink = (titled.max(axis=2) < 160) & ~red
    rows, columns = np.nonzero(ink)
    assert len(rows) > 20
    assert columns.max() < SMALL[0] / 2
    assert not ((plain.max(axis=2) < 160) & (plain[..., 0] - plain[..., 1] <= 30)).any()
    part = np.nonzero(red)[0]
    assert rows.max() < part.min()
    assert part.max() < SMALL[1] - 2


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"size": (0, 10)}, ArgumentError),
        ({"size": (10.5, 10)}, ArgumentError),
        ({"view": "from above"}, ArgumentError),
        ({"view": (0.0, 2.0)}, ArgumentError),
        ({"view": (math.nan, 0.0)}, ArgumentError),
        ({"color": "no such colour"}, ArgumentError),
    ],
)
def test_bad_arguments_write_nothing(tmp_path, options, error):
    with pytest.raises(error, match=next(iter(options))):
        render(box((0, 0, 0), (1, 1, 1)), tmp_path / "a.png", **options)
    assert not list(tmp_path.iterdir())


def test_bad_meshes_and_paths_write_nothing(tmp_path):
    cube = box((0, 0, 0), (1, 1, 1))
    with pytest.raises(ArgumentTypeError, match="mesh"):
        render("cube", tmp_path / "a.png")  # type: ignore[arg-type]
    with pytest.raises(EmptyError, match="mesh"):
        render(Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32)), tmp_path / "a.png")
    with pytest.raises(FileError, match="png"):
        render(cube, tmp_path / "a.jpg")
    with pytest.raises(FileError, match="folder"):
        render(cube, tmp_path / "nowhere" / "a.png")
    assert not list(tmp_path.iterdir())


def test_an_old_picture_survives_a_failure(tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    path.write_bytes(b"old")

    def fail(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(Image.Image, "save", fail)
    with pytest.raises(KeyboardInterrupt):
        render(box((0, 0, 0), (1, 1, 1)), path, size=SMALL)
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]


@pytest.mark.parametrize("display", [None, ""])
def test_no_display_and_no_noise(tmp_path, display):
    code = (
        "import numpy as np; from frep.mesh import Mesh; from frep.view import render;"
        "render(Mesh(np.eye(4, 3), np.array([[0,1,2],[0,3,1],[1,3,2],[2,3,0]])), 'a.png', size=(80, 60))"
    )
    environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))
    if display is not None:
        environment["DISPLAY"] = display
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert Image.open(tmp_path / "a.png").size == (80, 60)
