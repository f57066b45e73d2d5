"""Sparse sampling against dense evaluation: signs everywhere, values in leaves, no surface lost; refusals and estimates."""

from __future__ import annotations

import math
import time
import warnings

import numpy as np
import pytest

import frep
from frep import (
    ArgumentError,
    ArgumentTypeError,
    EmptyError,
    FunctionError,
    Solid,
    ThinWallWarning,
    TooLargeError,
    UnboundedError,
)
from frep.grid import INSIDE, LEAF, OUTSIDE, SparseGrid
from frep.sampling import Lattice
from graded import distance_to, linear, parabola
from topologies import beams, tpms

RNG = np.random.default_rng(6)
X, Y, Z = frep.coordinates()


def parts() -> dict[str, tuple[Solid, float]]:
    box = frep.box((0, 0, 0), (20, 15, 12))
    ball = frep.sphere((3, 4, 5), 7)
    nodes = RNG.uniform(0, 20, (40, 3))
    graph = beams.graph(nodes, [(i, (7 * i + 3) % 40) for i in range(40) if i != (7 * i + 3) % 40])
    law = parabola("x", 0, 20, ends=0.8, middle=2.0)
    return {
        "ball": (ball, 0.5),
        "torus": (frep.torus((1, 2, 3), (1, 2, 2), 8, 2), 0.6),
        "shell": (ball.shell(1.2), 0.4),
        "simple cubic": (beams.simple_cubic(5).thicken(1.2) & box, 0.35),
        "graded bcc": (beams.bcc(5).thicken(law, node=1.1 * law) & box, 0.4),
        "blended bcc": (beams.bcc(5).thicken(1.0, blend=0.6) & box, 0.4),
        "squares": (beams.bcc((5, 6, 4)).thicken(1.0, section=beams.square(0.2)) & box, 0.4),
        "graph": (graph.thicken(np.linspace(0.8, 2.4, 40), blend=0.4), 0.35),
        "gyroid": (tpms.gyroid(cell=8).sheet(linear("z", 0, 12, 0.7, 2.0)) & box, 0.3),
        "gyroid in a ball": (
            tpms.gyroid(cell=5).sheet(linear(distance_to(ball), 0, 5, 1.5, 0.6)) & ball | ball.shell(0.8),
            0.3,
        ),
        "twisted": (
            Solid(
                tpms.schwarz_p(cell=6)
                .sheet(0.9)
                .field.substitute(
                    X * frep.cos(0.05 * Z) - Y * frep.sin(0.05 * Z), X * frep.sin(0.05 * Z) + Y * frep.cos(0.05 * Z), Z
                ),
                bounds=((-8, -8, 0), (8, 8, 12)),
            ),
            0.4,
        ),
        "blended union": (frep.union(ball, box, frep.cylinder((0, 0, 0), (20, 15, 20), 2), blend=1 + 0.05 * X), 0.6),
        "foreign": (
            Solid(
                frep.foreign(lambda x, y, z: np.sqrt(x * x + y * y + z * z) - 5 + np.sin(3 * x) / 3, lipschitz=2.0),
                bounds=((-6, -6, -6), (6, 6, 6)),
            ),
            0.4,
        ),
        "rotated": (
            (beams.simple_cubic(4).thicken(1.0).rotate((1, 2, 3), 0.6) & box).scale(0.5).translate((3, 3, 3)),
            0.18,
        ),
    }


PARTS = parts()


def sampled(name: str) -> tuple[SparseGrid, np.ndarray, np.ndarray]:
    """A part's grid, exact values at all its samples, and which samples lie in leaves."""
    part, voxel = PARTS[name]
    grid = part.sample(voxel)
    axes = [grid.origin[a] + grid.voxel * np.arange(grid.shape[a]) for a in range(3)]
    exact = part.field(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)).reshape(grid.shape)
    leaf = grid.table >= 0
    for axis in range(3):
        leaf = np.repeat(leaf, LEAF, axis=axis)
    return grid, exact, leaf


@pytest.mark.parametrize("name", PARTS)
def test_grid_is_the_field(name):
    """Every sample has the sign of the field; near the surface it has its value; what is no leaf touches no surface."""
    grid, exact, leaf = sampled(name)
    dense = grid.dense()
    # Where the field is zero to the last digits of float32, either sign is right.
    clear = np.abs(exact) > 2e-6
    np.testing.assert_array_equal((dense < 0)[clear], (exact < 0)[clear])
    band = leaf & (np.abs(exact) < 2 * grid.voxel)
    np.testing.assert_allclose(dense[band], exact[band], atol=2e-5)
    # No sign change along any grid edge that has an end outside the leaves.
    inside = exact < 0
    for axis in range(3):
        low, high = [slice(None)] * 3, [slice(None)] * 3
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        change = inside[tuple(low)] != inside[tuple(high)]
        assert np.all(leaf[tuple(low)][change] & leaf[tuple(high)][change])
    # The outermost samples are outside: the mesh will be closed.
    for axis in range(3):
        for side in (0, -1):
            assert not np.take(inside, side, axis=axis).any()


@pytest.mark.parametrize("name", PARTS)
def test_grid_is_well_formed(name):
    part, voxel = PARTS[name]
    grid = part.sample(voxel)
    assert set(np.unique(grid.table[grid.table < 0])) <= {INSIDE, OUTSIDE}
    np.testing.assert_array_equal(grid.table[tuple(grid.leaves.T)], np.arange(len(grid.leaves)))
    assert np.count_nonzero(grid.table >= 0) == len(grid.leaves) == len(grid.values)
    assert grid.values.dtype == np.float32
    assert np.all(np.lexsort(grid.leaves.T[::-1]) == np.arange(len(grid.leaves)))
    assert grid.n_voxels_evaluated == grid.values.size <= grid.n_voxels_in_box
    assert np.all(grid.origin < part.bounds[0])
    assert np.all(grid.origin + grid.voxel * (np.array(grid.shape) - 1) > part.bounds[1])


@pytest.mark.parametrize("name", ["ball", "simple cubic", "gyroid"])
def test_leaves_are_few(name):
    """Within twice the blocks that hold surface."""
    grid, exact, _ = sampled(name)
    inside = np.pad(exact < 0, 1)
    cells = np.zeros(grid.table.shape, bool)
    blocks = inside[1:-1, 1:-1, 1:-1].reshape(
        grid.table.shape[0], LEAF, grid.table.shape[1], LEAF, grid.table.shape[2], LEAF
    )
    cells |= blocks.any(axis=(1, 3, 5)) & ~blocks.all(axis=(1, 3, 5))
    assert len(grid.leaves) <= 2.0 * np.count_nonzero(cells) + 8


def test_samples_keep_clear_of_the_faces_of_the_box():
    for size in RNG.uniform(1, 30, (200, 3)):
        lo, voxel = RNG.uniform(-100, 100, 3), float(RNG.uniform(0.05, 1.0))
        lattice = Lattice.over(lo, lo + size, voxel)
        for a, axis in enumerate(lattice.axes()):
            for face in (lo[a], lo[a] + size[a]):
                assert np.abs(axis - face).min() > 0.24 * voxel
            assert axis[0] < lo[a]
            assert axis[-1] > lo[a] + size[a]


@pytest.mark.parametrize("name", ["ball", "graded bcc", "gyroid in a ball"])
def test_far_from_the_origin_the_same_samples(name):
    """float32 blocks at x = 1e6 mm: as at 0, within a thousandth of a voxel."""
    part, voxel = PARTS[name]
    near, far = part.sample(voxel), part.translate((1e6, -2e5, 0)).sample(voxel)
    np.testing.assert_array_equal(near.table, far.table)
    band = np.abs(near.values) < 2 * voxel
    np.testing.assert_allclose(far.values[band], near.values[band], atol=1e-3 * voxel)


def test_tolerance_chooses_the_voxel():
    """Facet centres keep within the tolerance, but for a hundredth of them."""
    for part in (frep.sphere((0, 0, 0), 10), frep.torus((0, 0, 0), (0, 0, 1), 10, 3)):
        for tolerance in (0.05, 0.01):
            mesh = part.mesh(tolerance=tolerance)
            away = np.abs(part.field(mesh.vertices[mesh.faces].mean(axis=1)))
            assert np.percentile(away, 99) < 1.2 * tolerance
            # And it does not do a great deal more than asked.
            assert np.percentile(away, 99) > 0.2 * tolerance


def test_default_voxel_is_fine_enough_for_walls():
    part = frep.sphere((0, 0, 0), 10).shell(0.9)
    grid = part.sample()
    assert grid.voxel <= 0.45


# --- warnings and refusals ---------------------------------------------------------------------------------------------


def test_thin_walls_warn_with_the_wall_and_a_voxel_that_resolves_it():
    part = beams.bcc(5).thicken(linear("x", 0, 20, 0.7, 2.0)) & frep.box((0, 0, 0), (20, 10, 10))
    with pytest.warns(ThinWallWarning, match="thinnest beam is 0.7") as caught:
        part.mesh(voxel=0.5)
    voxel = float(str(caught[0].message).split("a voxel of ")[-1].split(" mm")[0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        part.sample(voxel)


def test_thin_walls_are_found_where_the_law_keeps_step_with_the_leaves():
    """Leaves are stored in rows along z: every so many of them, whatever the number, may miss a wave along z."""
    wall = 4 + 3 * frep.sin(Z * (6 * np.pi / 400))
    part = tpms.schwarz_p(20).sheet(wall) & frep.box((0, 0, 0), (200, 200, 400))
    with pytest.warns(ThinWallWarning, match="thinnest wall is 1"):
        part.sample(1.0)


@pytest.mark.filterwarnings("error::frep.ThinWallWarning")
def test_walls_of_two_voxels_do_not_warn():
    box = frep.box((0, 0, 0), (10, 10, 10))
    (beams.bcc(5).thicken(1.0) & box).sample(0.5)
    (tpms.gyroid(5).sheet(0.8) & box).sample(0.4)
    # Where the wall is thin there is no material.
    (tpms.gyroid(5).sheet(linear("x", 0, 10, 2.0, 0.1)) & frep.box((0, 0, 0), (4, 4, 4))).sample(0.3)


def test_the_thinnest_of_several_features_is_named():
    part = frep.box((0, 0, 0), (20, 20, 20)).shell(0.5) | beams.bcc(5).thicken(2) & frep.box((0, 0, 0), (20, 20, 20))
    with pytest.warns(ThinWallWarning, match="thinnest wall is 0.5"):
        part.sample(0.5)


@pytest.mark.parametrize("law", [X - 5, 0.2 * X - 1, frep.sin(X)], ids=repr)
@pytest.mark.parametrize("make", [tpms.gyroid(6).sheet, beams.bcc(6).thicken, frep.sphere((9, 9, 9), 8).shell])
def test_a_width_that_is_not_positive_somewhere_is_refused(make, law):
    part = make(law) & frep.box((0, 0, 0), (18, 18, 18))
    with pytest.raises(ArgumentError, match="more than 0 mm"):
        part.sample(0.5)


INFINITE = {
    "x, y, z": tpms.gyroid(5).sheet(1),
    "x, y": beams.bcc(5).thicken(1) & frep.half_space((0, 0, 1)) & frep.half_space((0, 0, -1), (0, 0, -9)),
    "z": frep.Solid(frep.hypot(X, Y) - 5, bounds=((-5, -5, 0), (5, 5, np.inf))),
}


@pytest.mark.parametrize("axes", INFINITE)
def test_infinite_solids_are_refused(axes):
    for ask in (lambda s: s.mesh(voxel=1), lambda s: s.sample(), lambda s: s.volume(voxel=1)):
        with pytest.raises(UnboundedError, match=rf"infinite along {axes}: .*intersect"):
            ask(INFINITE[axes])


BOX = frep.box((2, 2, 2), (8, 8, 8))
EMPTY = [
    ("do not overlap", BOX & frep.box((20, 0, 0), (30, 9, 9))),
    ("'simple_cubic' has no material", beams.simple_cubic(10).thicken(1) & BOX),
    ("removes all", BOX - frep.sphere((5, 5, 5), 20)),
    ("'solid' has no material", BOX & Solid(X + 100.0)),
    ("empty", Solid(X * 0 + 1.0, bounds=((0, 0, 0), (1, 1, 1)))),
]


@pytest.mark.parametrize(("message", "part"), EMPTY, ids=[m for m, _ in EMPTY])
def test_empty_solids_are_refused_and_the_empty_part_named(message, part):
    for ask in (lambda: part.sample(0.5), lambda: part.mesh(voxel=0.5), lambda: part.volume(voxel=0.5)):
        with pytest.raises(EmptyError, match=message):
            ask()


@pytest.mark.parametrize(
    "part",
    [
        frep.box((0, 0, 0), (100, 100, 100)),
        frep.sphere((0, 0, 0), 50),
        beams.bcc(5).thicken(1) & frep.box((0, 0, 0), (100, 100, 100)),
        tpms.gyroid(5).sheet(1) & frep.box((0, 0, 0), (100, 100, 100)),
    ],
    ids=["box", "ball", "bcc", "gyroid"],
)
@pytest.mark.parametrize("voxel", [1e-4, 1e-9])
def test_too_small_a_voxel_is_refused_before_memory_is_taken(part, voxel):
    start = time.monotonic()
    with pytest.raises(TooLargeError, match=r"GB.*a voxel of [0-9.e-]+ mm would fit") as caught:
        part.mesh(voxel=voxel)
    assert time.monotonic() - start < 30, "it must refuse, not try"
    fits = float(str(caught.value).split("a voxel of ")[1].split(" mm")[0])
    assert 5e-3 < fits < 0.5


BALL = frep.sphere((0, 0, 0), 5)
BAD = [
    ("voxel", ArgumentError, lambda ask: ask(voxel=0)),
    ("voxel", ArgumentError, lambda ask: ask(voxel=-1)),
    ("voxel", ArgumentError, lambda ask: ask(voxel=math.nan)),
    ("voxel", ArgumentError, lambda ask: ask(voxel=math.inf)),
    ("voxel", ArgumentTypeError, lambda ask: ask(voxel=X)),
    ("voxel", ArgumentTypeError, lambda ask: ask(voxel="fine")),
    ("tolerance", ArgumentError, lambda ask: ask(tolerance=0)),
    ("tolerance", ArgumentTypeError, lambda ask: ask(tolerance=X)),
    ("tolerance", ArgumentError, lambda ask: ask(voxel=1, tolerance=0.1)),
]


@pytest.mark.parametrize("ask", [BALL.sample, BALL.mesh], ids=["sample", "mesh"])
@pytest.mark.parametrize(("argument", "error", "call"), BAD)
def test_bad_input_names_the_argument(ask, argument, error, call):
    with pytest.raises(error, match=rf"\b{argument}\b"):
        call(ask)


def test_functions_that_fail_are_named():
    def broken(x, y, z):
        return np.where(x > 2, np.nan, np.sqrt(x * x + y * y + z * z) - 4)

    with pytest.raises(FunctionError, match=r"broken|NaN|nan"):
        Solid(frep.foreign(broken), bounds=((-5, -5, -5), (5, 5, 5))).mesh(voxel=0.5)
    with pytest.raises(FunctionError, match=r"NaN|nan"):
        Solid(frep.sqrt(X) - 1, bounds=((-5, -5, -5), (5, 5, 5))).mesh(voxel=0.5)
