"""Variants, scales and natural parameters of every periodic surface."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy.spatial import cKDTree

import frep
from frep import ArgumentError, ArgumentTypeError
from frep.redistance import NODES, periodic_distance
from topologies import tpms
from topologies.variants import _depths, percolates

RNG = np.random.default_rng(23)
X, Y, Z = frep.coordinates()
U = 10.0
"""One cubic cell for all: a distance is made once for a surface and cell."""

POINTS = RNG.uniform(-U, 2 * U, (4000, 3))
ENTRIES = sorted(tpms.SURFACES)
CLOSED = {"p_w_hybrid"}
"""Surfaces of which one side is closed pockets."""


@pytest.fixture(autouse=True)
def quiet():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", tpms.LoosePiecesWarning)
        warnings.simplefilter("ignore", tpms.SealedChannelWarning)
        yield


def on_surface(surface: tpms.PeriodicSurface, n: int = 1500) -> tuple[np.ndarray, np.ndarray]:
    """Points of the zero set and unit normals, by Newton steps on the level function alone."""
    points = RNG.uniform(-0.5, 0.5, (n, 3)) * surface.cell
    for _ in range(40):
        gradient = surface.level.gradient(points)
        squared = (gradient**2).sum(axis=1)
        squared = np.maximum(squared, 1e-3 * squared.max())
        step = (surface.level(points) / squared)[:, None] * gradient
        length = np.linalg.norm(step, axis=1)[:, None]
        points = points - step * np.minimum(1.0, 0.05 * min(surface.cell) / np.maximum(length, 1e-300))
    points = points[np.abs(surface.level(points)) < 1e-10]
    assert len(points) > 0.8 * n
    gradient = surface.level.gradient(points)
    return points, gradient / np.linalg.norm(gradient, axis=1)[:, None]


@pytest.mark.parametrize("name", ENTRIES)
def test_walls_have_the_thickness_asked_for(name):
    """A wall of a hundredth of the cell ends after half of it along both normals; C(S) has the finest features."""
    surface = tpms.SURFACES[name](cell=U)
    points, normals = on_surface(surface)
    for side in (-1.0, 1.0):
        at_end = np.abs(surface.sheet(0.1).field(points + side * 0.05 * normals))
        # At 4.4 % of 20,000 places of C(S), and at fewer of the others, it is off by more.
        assert np.quantile(at_end, 0.94) < 1e-3
        assert at_end.max() < 0.012


@pytest.mark.parametrize("name", ENTRIES)
def test_meshes_closed_and_manifold(name):
    surface = tpms.SURFACES[name](cell=U)
    box = frep.box((0, 0, 0), (U, U, U))
    for part in (surface.sheet(0.9), surface.solid(bias=0.1)):
        report = (part & box).mesh(voxel=0.3).check()
        assert report.closed
        assert report.manifold


@pytest.mark.parametrize("name", ENTRIES)
def test_variants_part_space(name):
    surface = tpms.SURFACES[name](cell=U)
    wall, bias = 0.6, 0.07
    solid, inverse = surface.solid(bias).contains(POINTS), surface.inverse(bias).contains(POINTS)
    np.testing.assert_array_equal(solid, ~inverse)
    sheet, twin = surface.sheet(wall, bias=bias).contains(POINTS), surface.twin(wall, bias).contains(POINTS)
    np.testing.assert_array_equal(sheet, ~twin)
    # The wall lies astride the biased surface, each half of the twin on one side of it.
    thin, thick = surface.solid(bias - wall / 2).contains(POINTS), surface.solid(bias + wall / 2).contains(POINTS)
    np.testing.assert_array_equal(twin, thin | ~thick)


@pytest.mark.parametrize("name", ["gyroid", "schwarz_p", "schwarz_d"])
def test_sides_of_congruent_surfaces_are_equal(name):
    surface = tpms.SURFACES[name](cell=U)
    box = frep.box((0, 0, 0), (U, U, U))
    assert surface.complement_congruent
    assert (surface.solid() & box).volume(voxel=0.25) == pytest.approx(U**3 / 2, rel=2e-3)
    grown, shrunk = (surface.solid(bias=b) & box for b in (0.4, -0.4))
    assert grown.volume(voxel=0.25) + shrunk.volume(voxel=0.25) == pytest.approx(U**3, rel=2e-3)


def test_biases_are_millimetres():
    surface = tpms.gyroid(cell=U)
    points, normals = on_surface(surface)
    for bias in (-0.5, 0.3):
        assert np.abs(surface.solid(bias).field(points + bias * normals)).max() < 1e-4
    law = 0.2 + 0.02 * X
    np.testing.assert_allclose(surface.inverse(law).field(POINTS), law(POINTS) - surface.distance(POINTS), atol=1e-5)
    np.testing.assert_allclose(
        surface.sheet(0.5, bias=law).field(POINTS), np.abs(surface.distance(POINTS) - law(POINTS)) - 0.25, atol=1e-5
    )


# --- scales ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["gyroid", "iwp", "schwarz_p"])
def test_scales_share_their_zero_set_and_sides(name):
    make = tpms.SURFACES[name]
    level = make(cell=U).level(POINTS)
    clear = np.abs(level) > 1e-3
    for scale in ("distance", "gradient", "range"):
        value = make(cell=U, scale=scale).value(POINTS)
        np.testing.assert_array_equal(value[clear] > 0, level[clear] > 0)


def test_gradient_scale_is_the_distance_to_first_order():
    surface = tpms.gyroid(cell=U, scale="gradient")
    points, normals = on_surface(surface)
    for reach in (0.2, 0.1):
        off = np.abs(surface.value(points + reach * normals) - reach)
        assert off.max() < 0.2 * reach**2
    # lf-rep 3.4: a fifth of the cell thick, the wall is short of material: 0.521 of the cell and not 0.585.
    part = surface.sheet(0.2 * U) & frep.box((0, 0, 0), (U, U, U))
    assert part.volume(voxel=0.2) / U**3 == pytest.approx(0.521, abs=4e-3)


@pytest.mark.parametrize(
    ("name", "least", "most"),
    [
        ("gyroid", -1.5, 1.5),
        ("neovius", -13, 13),
        ("octo", -0.75, 3.25),
        ("fischer_koch_s", -math.sqrt(2), math.sqrt(2)),
    ],
)
def test_range_scale_reaches_a_quarter_of_the_cell(name, least, most):
    surface = tpms.SURFACES[name](cell=U, scale="range")
    assert surface.range == pytest.approx((least, most), abs=1e-4)
    np.testing.assert_allclose(surface.value(POINTS), surface.level(POINTS) * U / 4 / max(-least, most), rtol=1e-4)
    assert np.abs(surface.value(POINTS)).max() <= U / 4 + 1e-9


# --- natural parameters --------------------------------------------------------------------------------------------------


def test_phase_moves_the_pattern():
    still, moved = tpms.gyroid(cell=U), tpms.gyroid(cell=U, phase=(math.pi / 2, 0, -math.pi))
    shift = np.array([U / 4, 0, -U / 2])
    np.testing.assert_allclose(moved.level(POINTS), still.level(POINTS + shift), atol=1e-9)
    np.testing.assert_allclose(moved.distance(POINTS), still.distance(POINTS + shift), atol=1e-4)
    bent = tpms.gyroid(cell=U, phase=(0, 0.3 * frep.sin(X / 9), 0))
    np.testing.assert_allclose(
        bent.distance(POINTS),
        still.distance(POINTS + (U / math.tau * 0.3 * np.sin(POINTS[:, :1] / 9)) * [0, 1, 0]),
        atol=1e-4,
    )


def test_rotation_turns_the_pattern():
    still, turned = tpms.gyroid(cell=U), tpms.gyroid(cell=U, rotation=("z", 0.4))
    c, s = math.cos(0.4), math.sin(0.4)
    matrix = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    np.testing.assert_allclose(turned.level(POINTS @ matrix.T), still.level(POINTS), atol=1e-9)
    np.testing.assert_allclose(turned.distance(POINTS @ matrix.T), still.distance(POINTS), atol=1e-4)
    np.testing.assert_allclose(tpms.gyroid(cell=U, rotation=matrix).level(POINTS), turned.level(POINTS), atol=1e-12)
    # As a solid is rotated.
    np.testing.assert_allclose(
        turned.sheet(1.0).field(POINTS), still.sheet(1.0).rotate("z", 0.4).field(POINTS), atol=1e-4
    )


def test_both_periods_of_the_diamond():
    """LatticeQuery's cell is half a period of the formula: eight of them make the other one."""
    small, large = tpms.schwarz_d(cell=U, period="pi"), tpms.schwarz_d(cell=2 * U)
    np.testing.assert_allclose(small.level(POINTS), large.level(POINTS), atol=1e-9)
    sheet = small.sheet(1.0)
    for axis in range(3):
        np.testing.assert_allclose(sheet.field(POINTS + U * np.eye(3)[axis]), sheet.field(POINTS), atol=1e-2)
    assert small.pinch == pytest.approx(2 * large.pinch)


def test_drops_that_are_numbers_keep_true_distances():
    surface = tpms.schwarz_p(cell=U, drop_x=0.6)
    points, normals = on_surface(surface)
    assert np.abs(surface.sheet(0.4).field(points + 0.2 * normals)).max() < 1e-3
    prism = tpms.gyroid(cell=U, drop_x=0).sheet(0.6)
    np.testing.assert_allclose(prism.field(POINTS), prism.field(POINTS * (0, 1, 1)), atol=1e-4)


def test_drops_that_vary():
    drop = frep.clip(Z / U, 0, 1)
    level = tpms.schwarz_p(cell=U, drop_x=drop).level(POINTS)
    angles = math.tau * POINTS / U
    expected = drop(POINTS) * np.cos(angles[:, 0]) + np.cos(angles[:, 1]) + np.cos(angles[:, 2])
    np.testing.assert_allclose(level, expected, atol=1e-9)
    part = tpms.schwarz_p(cell=U, drop_x=drop, scale="gradient").sheet(1.0) & frep.box((0, 0, 0), (U, U, U))
    assert part.mesh(voxel=0.4).check().closed
    with pytest.raises(ArgumentError, match='scale="gradient"'):
        tpms.schwarz_p(cell=U, drop_x=drop).sheet(1.0)


VARYING = {
    "drop": lambda **more: tpms.gyroid(cell=U, drop_x=frep.clip(X / 20, 0.3, 1), **more),
    "phase": lambda **more: tpms.gyroid(cell=U, phase=(0, 0.8 * frep.sin(X / 4), 0), **more),
    "turned": lambda **more: tpms.schwarz_p(
        cell=(U, 0.8 * U, U), rotation=("z", 0.3), phase=(0, 0, 0.5 * frep.sin(X / 4)), **more
    ),
    # Evenly, which is a stretch and not a turn.
    "stretched": lambda **more: tpms.gyroid(cell=U, phase=(X / 10, 0, 0), **more),
    "member": lambda **more: tpms.primitive_gyroid_diamond(frep.clip(X / 20 + 0.6, 0, 1.4), U, **more),
}


@pytest.mark.parametrize("kind", VARYING)
def test_what_varies_has_true_distances_over_a_box(kind):
    """Against a cloud of points on the zero set; the first order, or the surface before it is moved, is several times off."""
    lo, hi = np.zeros(3), np.array([1.6, 1.0, 1.0]) * U
    surface = VARYING[kind](over=(lo, hi))
    cloud = RNG.uniform(lo - 1.5, hi + 1.5, (120000, 3))
    for _ in range(15):
        slope = surface.level.gradient(cloud)
        step = (surface.level(cloud) / np.maximum((slope**2).sum(1), 1e-3))[:, None] * slope
        cloud = cloud - step * np.minimum(1, 0.5 / np.maximum(np.linalg.norm(step, axis=1), 1e-300))[:, None]
    cloud = cloud[np.abs(surface.level(cloud)) < 1e-9]
    points = RNG.uniform(lo + 1.5, hi - 1.5, (3000, 3))
    brute = cKDTree(cloud).query(points)[0]
    asked = (brute > 0.04 * U) & (brute < 0.12 * U)

    def off(field: frep.Field) -> float:
        return float(np.quantile(np.abs(np.abs(field(points)) - brute)[asked], 0.95))

    found = off(surface.distance)
    assert found < 3e-3 * U
    assert off(VARYING[kind](scale="gradient").value) > 1.8 * found
    if kind in ("phase", "turned", "stretched"):
        assert off(VARYING[kind]().distance) > 2 * found
    # Beyond the box the wall goes on, to first order.
    beyond = POINTS[np.any((lo > POINTS) | (hi < POINTS), axis=1)]
    np.testing.assert_allclose(surface.distance(beyond), VARYING[kind](scale="gradient").value(beyond), atol=1e-9)
    part = surface.sheet(0.8) & frep.box(lo, hi)
    assert part.mesh(voxel=0.4).check().closed


def test_a_box_changes_nothing_where_nothing_varies():
    """A surface that is only moved and turned has its distance from one period, which is finer."""
    plain, boxed = (
        tpms.gyroid(cell=U, rotation=("z", 0.4), over=over) for over in (None, frep.box((0,) * 3, (9,) * 3))
    )
    assert boxed.distance is plain.distance


def test_transitions_by_a_field():
    """Where the law stands still, the sheet is that of the number; between, its middle is where the formula is zero."""
    law = frep.clip(Z / U, 0.0, 1.0)
    graded, plain = tpms.primitive_neovius(law, cell=U), tpms.primitive_neovius(0.0, cell=U)
    below = POINTS * (1, 1, 0) - (0, 0, U / 3)
    np.testing.assert_allclose(graded.sheet(0.8).field(below), plain.sheet(0.8).field(below), atol=1e-4)
    points = RNG.uniform(0, U, (3000, 3))
    for _ in range(30):
        points = points - (graded.distance(points))[:, None] * graded.distance.gradient(points)
    points = points[(np.abs(graded.distance(points)) < 1e-6) & (points[:, 2] < 0.5 * U)]
    assert len(points) > 500
    off = graded.level(points) / np.linalg.norm(graded.level.gradient(points), axis=1)
    assert np.abs(off).max() < 0.01 * U
    assert np.median(np.abs(off)) < 1e-3 * U
    part = tpms.primitive_gyroid_diamond(Z / U, cell=U, scale="gradient").sheet(1.0)
    assert (part & frep.box((0, 0, 0), (U, U, 2 * U))).mesh(voxel=0.5).check().closed


def test_own_formulas():
    mine = tpms.surface(lambda x, y, z: np.cos(x) + np.cos(y) + np.cos(z), cell=U)
    np.testing.assert_allclose(mine.distance(POINTS), tpms.schwarz_p(cell=U).distance(POINTS), atol=1e-5)
    with pytest.raises(ArgumentError, match="period"):
        tpms.surface(lambda x, y, z: x + np.cos(y), cell=U)


def test_scherk_tends_to_planes():
    surface = tpms.scherk(cell=U)
    high = POINTS * (1, 1, 0) + (0, 0, 3 * U)
    # cos y = 0 at odd quarters of the cell.
    to_plane = np.abs((high[:, 1] - U / 4 + U / 4) % (U / 2) - U / 4)
    np.testing.assert_allclose(np.abs(surface.distance(high)), to_plane, atol=0.06)


# --- limits --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [n for n in ENTRIES if n != "scherk"])
def test_depths_of_the_table_are_those_of_the_distance(name):
    surface = tpms.SURFACES[name](cell=U)
    found = _depths(surface.distance, surface.period)
    # Found on 64 nodes, with half a diagonal of them on top of the full depths.
    slack = 0.5 * math.sqrt(3) * U / 64
    assert surface.depths is not None
    np.testing.assert_allclose(surface.depths.pinch, found.pinch, atol=0.01 * U)
    np.testing.assert_allclose(surface.depths.full, np.array(found.full) - slack, atol=0.006 * U)
    assert (min(surface.depths.pinch) == 0.0) == (name in CLOSED)


def test_percolation():
    grid = np.stack(np.meshgrid(*[np.arange(16)] * 3, indexing="ij"), -1)
    ball = ((grid - 8.0) ** 2).sum(-1) < 30
    assert not percolates(ball)
    assert not percolates(np.roll(ball, 8, axis=(0, 1, 2)))  # the same ball across the faces
    assert percolates(~ball)
    assert percolates(((grid[..., :2] - 8.0) ** 2).sum(-1) < 10)  # a rod along z
    assert percolates((grid.sum(-1) % 16) < 2)  # slanted layers
    assert not percolates(np.zeros((4, 4, 4), bool))


def test_pinch_limits_in_closed_form():
    """Half the sheet: P, from the middle of a neck to the surface, along the diagonal of a face; the gyroid, from a triple
    point of its net, (1/8, 1/8, 1/8), to the flat point (0, 0, 0). The middle of P's cell is sqrt(3) / 4 away."""
    assert tpms.schwarz_p().pinch == pytest.approx(math.sqrt(2) / 3, abs=2e-3)
    assert tpms.gyroid().pinch == pytest.approx(math.sqrt(3) / 4, abs=2e-3)
    assert tpms.schwarz_p().full == pytest.approx(math.sqrt(3) / 2, abs=2e-3)
    assert tpms.gyroid(cell=U).distance((U / 8, U / 8, U / 8)) == pytest.approx(math.sqrt(3) / 8 * U, abs=2e-3 * U)


def test_limits_of_biases_and_gaps():
    surface = tpms.gyroid(cell=U)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        surface.solid(2.1)
        surface.inverse(-2.1)
        surface.twin(1.0)
    for call, kind in [
        (lambda: surface.solid(2.25), tpms.SealedChannelWarning),
        (lambda: surface.solid(-2.25), tpms.LoosePiecesWarning),
        (lambda: surface.inverse(2.25), tpms.LoosePiecesWarning),
        (lambda: surface.inverse(-2.25), tpms.SealedChannelWarning),
        (lambda: surface.twin(4.45), tpms.LoosePiecesWarning),
        (lambda: surface.sheet(1.0, bias=1.8), tpms.SealedChannelWarning),
        (lambda: tpms.p_w_hybrid(cell=U).solid(), tpms.LoosePiecesWarning),
    ]:
        with pytest.warns(kind):
            call()
    for argument, call in [
        ("bias", lambda: surface.solid(2.6)),
        ("bias", lambda: surface.solid(-2.6)),
        ("bias", lambda: surface.inverse(2.6 + frep.clip(X, 0, 1))),
        ("bias", lambda: surface.sheet(0.2, bias=2.6)),
        ("thickness", lambda: surface.twin(4.9)),
    ]:
        with pytest.raises(ArgumentError, match=rf"^{argument}\b"):
            call()


BAD = [
    ("scale", ArgumentError, lambda: tpms.gyroid(5, scale="true")),
    ("drop_x", ArgumentError, lambda: tpms.gyroid(5, drop_x=1.1)),
    ("drop_z", ArgumentError, lambda: tpms.schwarz_p(5, drop_z=-2)),
    ("drop_y", ArgumentError, lambda: tpms.gyroid(5, drop_y=2 + frep.clip(X, 0, 1))),
    ("drop_y", ArgumentTypeError, lambda: tpms.gyroid(5, drop_y="flat")),
    ("drop_x", ArgumentError, lambda: tpms.schwarz_d(5, drop_x=0)),
    ("drop_z", ArgumentError, lambda: tpms.scherk(5, drop_z=0.5)),
    ("phase", ArgumentTypeError, lambda: tpms.gyroid(5, phase=1.0)),
    ("phase", ArgumentError, lambda: tpms.gyroid(5, phase=(0, math.nan, 0))),
    ("rotation", ArgumentTypeError, lambda: tpms.gyroid(5, rotation=3)),
    ("rotation", ArgumentError, lambda: tpms.gyroid(5, rotation=2 * np.eye(3))),
    ("rotation", ArgumentError, lambda: tpms.gyroid(5, rotation=-np.eye(3))),
    ("period", ArgumentError, lambda: tpms.schwarz_d(5, period="3pi")),
    ("dropx", ArgumentTypeError, lambda: tpms.gyroid(5, dropx=0)),
    ("over", ArgumentTypeError, lambda: tpms.gyroid(5, over=3)),
    ("over", ArgumentError, lambda: tpms.gyroid(5, over=((1, 1, 1), (0, 2, 2)))),
    ("over", frep.UnboundedError, lambda: tpms.gyroid(5, over=frep.half_space((0, 0, 1)))),
    ("t", ArgumentError, lambda: tpms.primitive_gyroid_diamond(2.1)),
    ("t", ArgumentError, lambda: tpms.primitive_neovius(X)),
    ("level", ArgumentTypeError, lambda: tpms.surface(3)),
    ("level", ArgumentTypeError, lambda: tpms.surface(lambda x: x)),
    ("level", ArgumentTypeError, lambda: tpms.surface(lambda x, y, z: None)),
    ("level", ArgumentError, lambda: tpms.surface(lambda x, y, z: 1.0)),
    ("level", ArgumentError, lambda: tpms.surface(lambda x, y, z: 0.0 * x)),
    ("nan", ArgumentError, lambda: tpms.surface(lambda x, y, z: frep.sqrt(np.sin(x) - 2.0))),
    ("nan", ArgumentError, lambda: tpms.surface(lambda x, y, z: frep.sqrt(np.sin(x)) + np.cos(y))),
    ("thickness", ArgumentError, lambda: tpms.gyroid(U).twin(0)),
    ("thickness", ArgumentError, lambda: tpms.gyroid(U).sheet(frep.clip(X, -2, -1))),
    ("bias", ArgumentError, lambda: tpms.gyroid(U).solid(math.inf)),
]


@pytest.mark.parametrize(("argument", "error", "call"), BAD)
def test_bad_input_names_the_argument(argument, error, call):
    with pytest.raises(error, match=rf"\b{argument}\b"):
        call()


@pytest.mark.parametrize("cell", [(2.0, 6.0, 2.0), (10.0, 3.0, 2.5), (1.0, 1.0, 20.0)])
def test_stretched_cells_have_true_distances_and_small_tables(cell):
    """Against the same surface with a denser table: a stretched axis needs no more than twice the nodes of the shortest."""
    surface = tpms.gyroid(cell=cell)
    a, b, c = surface._nodes
    assert a * b * c <= 4 * NODES**3
    finer = periodic_distance(surface.members[0], surface.period, (a, b + b // 2, c + c // 2))
    points = np.random.default_rng(0).uniform(0.0, 10.0, (20_000, 3))
    found, wanted = surface.distance(points), finer(points)
    near = np.abs(wanted) < 0.1 * min(cell)
    assert near.sum() > 1000
    assert np.quantile(np.abs(found - wanted)[near], 0.99) < 1e-3 * min(cell)
