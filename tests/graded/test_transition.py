"""Transitions: the parents beyond the zone, one sheet and two labyrinths in it, true walls, faces of switches, reports."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

import frep
import graded
from frep import ArgumentError, ArgumentTypeError, Solid
from graded.regions import RegionWarning
from graded.transition import PROFILES, share_across
from topologies import beams, tpms

RNG = np.random.default_rng(5)
X, Y, Z = frep.coordinates()
U = 8.0
BOX = frep.box((0, 0, 0), (24, 12, 12))
MIDDLE = 12.0
PLANE = ((MIDDLE, 0, 0), "x")
GYROID, PRIMITIVE = tpms.gyroid(cell=U), tpms.schwarz_p(cell=U)
POINTS = RNG.uniform(BOX.bounds[0] - 2, BOX.bounds[1] + 2, (6000, 3))


def across(width: float, second=PRIMITIVE, **options) -> tpms.PeriodicSurface:
    return graded.transition(GYROID, second, plane=PLANE, width=width, **options)


def on_surface(level: frep.Field, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points on the zero set of a field, from some near it, and unit normals."""
    for _ in range(15):
        slope = level.gradient(points)
        step = (level(points) / np.maximum((slope**2).sum(1), 1e-3))[:, None] * slope
        points = points - step * np.minimum(1.0, 0.4 / np.maximum(np.linalg.norm(step, axis=1), 1e-300))[:, None]
    points = points[np.abs(level(points)) < 1e-9]
    slope = level.gradient(points)
    return points, slope / np.linalg.norm(slope, axis=1)[:, None]


# --- profiles ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", sorted(PROFILES))
@settings(max_examples=30, deadline=None)
@given(width=st.floats(0.01, 50), places=st.lists(st.floats(-80, 80), min_size=2, max_size=10))
def test_profiles_rise_from_0_to_1_and_are_odd(profile, width, places):
    share = share_across(X, width, profile)
    x = np.sort(places)
    points = np.stack([x, 0 * x, 0 * x], 1)
    values = share(points)
    assert np.all(np.diff(values) >= -1e-6)
    np.testing.assert_allclose(share(-points), 1.0 - values, atol=1e-6)
    assert np.all(values[x <= -width / 2 * (1 + 1e-12)] == 0.0)
    assert np.all(values[x >= width / 2 * (1 + 1e-12)] == 1.0)


def test_profiles_in_closed_form():
    x = np.linspace(-0.499, 0.499, 41)
    points = np.stack([x, 0 * x, 0 * x], 1)

    def values(name: str) -> np.ndarray:
        return share_across(X, 1.0, name)(points)

    s = x + 0.5
    np.testing.assert_allclose(values("linear"), s, atol=1e-12)
    np.testing.assert_allclose(values("smoothstep"), 3 * s**2 - 2 * s**3, atol=1e-12)
    logistic = [1 / (1 + math.exp(-10 * v)) for v in (*x, -0.5)]
    np.testing.assert_allclose(
        values("sigmoid"), (np.array(logistic[:-1]) - logistic[-1]) / (1 - 2 * logistic[-1]), atol=1e-9
    )
    normal = [0.5 * (1 + math.erf(6 * v / math.sqrt(2))) for v in (*x, -0.5)]
    np.testing.assert_allclose(
        values("gaussian"), (np.array(normal[:-1]) - normal[-1]) / (1 - 2 * normal[-1]), atol=1e-6
    )


# --- surfaces ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("over", [None, BOX], ids=["first order", "true"])
@pytest.mark.parametrize("profile", sorted(PROFILES))
def test_beyond_the_gap_surfaces_are_the_parents(profile, over):
    """O12: the parents' zero sets, distances and walls, to the last digit, also of a thickness that varies."""
    width = 0.5 * U
    both = across(width, over=over, profile=profile)
    wall = 0.5 + 0.01 * X
    for parent, side in ((GYROID, POINTS[:, 0] <= MIDDLE - width / 2), (PRIMITIVE, POINTS[:, 0] >= MIDDLE + width / 2)):
        points = POINTS[side]
        np.testing.assert_array_equal(both.sheet(wall).field(points), parent.sheet(wall).field(points))
        np.testing.assert_array_equal(both.solid(0.2).field(points), parent.solid(0.2).field(points))
        np.testing.assert_allclose(both.level(points) * parent.steepness, parent.level(points), atol=1e-12)


def test_no_gap_is_the_hard_switch():
    """The parents' bodies, each cut at the plane; and, with a face on the plane where the other has none, closed."""
    for over in (None, BOX):
        both = across(0.0, over=over)
        for body in (lambda s: s.sheet(0.8), lambda s: s.solid(0.1), lambda s: s.inverse(), lambda s: s.twin(0.8)):
            expected = np.where(POINTS[:, 0] < MIDDLE, body(GYROID).contains(POINTS), body(PRIMITIVE).contains(POINTS))
            np.testing.assert_array_equal(body(both).contains(POINTS), expected)
        np.testing.assert_array_equal(
            both.distance(POINTS) if over else both.value(POINTS),
            np.where(POINTS[:, 0] < MIDDLE, GYROID.distance(POINTS), PRIMITIVE.distance(POINTS)),
        )
    part = both.sheet(0.8) & BOX
    halves = [s.sheet(0.8) & BOX & Solid(side) for s, side in ((GYROID, X - MIDDLE), (PRIMITIVE, MIDDLE - X))]
    assert part.volume(voxel=0.2) == pytest.approx(sum(h.volume(voxel=0.2) for h in halves), rel=2e-3)
    mesh = part.mesh(voxel=0.25)
    assert mesh.check().closed
    # The cut is flat: no facet lies askew beside it.
    beside = np.abs(mesh.vertices[:, 0] - MIDDLE) < 0.1
    assert np.mean(np.abs(mesh.vertices[beside, 0] - MIDDLE) < 1e-3) > 0.5


@pytest.mark.parametrize("share", [0.25, 0.5, 1.0])
def test_one_sheet_and_two_labyrinths(share):
    """O12 (and lf-rep 6.4): across a quarter of the cell, a half, a whole one."""
    both = across(share * U, over=BOX)
    sheet = graded.connection_report(both.sheet(0.8) & BOX, voxel=0.2)
    assert sheet.main_share > 0.999
    voids = graded.connection_report(both.twin(0.8) & BOX, voxel=0.2)
    assert sum(p.volume > 0.02 * voids.pieces[0].volume for p in voids.pieces) == 2
    for side in (both.solid(-0.4), both.inverse(0.4)):
        assert graded.connection_report(side & BOX, voxel=0.2).main_share > 0.999


def test_distances_in_the_gap_against_brute_force():
    width = U
    both = across(width, over=BOX)
    lo, hi = np.array([MIDDLE - 4, 0, 0]), np.array([MIDDLE + 4, 12, 12])
    cloud, _ = on_surface(both.level, RNG.uniform(lo - 1, hi + 1, (150000, 3)))
    points = RNG.uniform(lo + (1, 2, 2), hi - (1, 2, 2), (4000, 3))
    brute = cKDTree(cloud).query(points)[0]
    asked = (brute > 0.3) & (brute < 0.8) & (np.abs(both.share(points) - 0.5) < 0.45)
    found = np.abs(both.distance(points))[asked]
    # A cloud is farther than its surface by about a squared spacing over the distance.
    assert np.quantile(np.abs(found - brute[asked]), 0.95) < 0.03
    first_order = np.abs(across(width).value(points))[asked]
    assert np.quantile(np.abs(first_order - brute[asked]), 0.95) > 0.06


@pytest.mark.parametrize("second", [PRIMITIVE, tpms.gyroid(cell=0.8 * U, rotation=("y", 0.6))], ids=["P", "rotated"])
def test_walls_in_the_gap(second):
    """From the middle of the wall along both normals, half of the thickness."""
    both = across(0.75 * U, second=second, over=BOX)
    start = RNG.uniform((MIDDLE - 2, 1, 1), (MIDDLE + 2, 11, 11), (6000, 3))
    points, normals = on_surface(both.level, start)
    inside = (np.abs(both.share(points) - 0.5) < 0.45) & np.all((points > 0.5) & (points < (24, 11.5, 11.5)), axis=1)
    points, normals = points[inside], normals[inside]
    assert len(points) > 1000
    thick = both.sheet(0.6)
    ends = [thick.field(points + side * 0.3 * normals) for side in (-1.0, 1.0)]
    wall = 0.6 - ends[0] - ends[1]
    assert np.median(np.abs(wall - 0.6)) < 2e-3
    assert np.quantile(np.abs(wall - 0.6), 0.9) < 0.05
    assert np.abs(both.distance(points)).max() < 0.02


@pytest.mark.parametrize("second", [PRIMITIVE, tpms.schwarz_d(cell=U)], ids=["P", "D"])
def test_walls_across_a_quarter_of_a_cell(second):
    """Where the surface bends most sharply: a tenth of the cell along normals, in nine tenths of all places to 2 %."""
    both = across(0.25 * U, second=second, over=BOX)
    points, normals = on_surface(both.level, RNG.uniform((MIDDLE - 1, 1, 1), (MIDDLE + 1, 11, 11), (4000, 3)))
    within = np.abs(points - (MIDDLE, 6, 6)) < (1, 5.5, 5.5)
    points, normals = points[within.all(axis=1)], normals[within.all(axis=1)]
    assert len(points) > 1000
    # All that the caliper meets on its way must be wall.
    reach = np.linspace(-0.4, 0.4, 41)
    field = both.sheet(0.8).field((points[:, None] + reach[:, None] * normals[:, None]).reshape(-1, 3))
    short = np.clip(field.reshape(len(points), -1).max(axis=1), 0.0, None)
    assert np.quantile(short, 0.9) < 0.02 * 0.8
    assert np.quantile(short, 0.95) < 0.04 * 0.8


def test_thickness_may_vary_and_features_are_kept():
    law = frep.clip(0.4 + 0.02 * X, 0.4, 1.0)
    part = across(U, over=BOX).sheet(law) & BOX
    assert part.features[0].width is law
    assert part.mesh(voxel=0.2).check().closed


def test_walls_that_vary_are_held_against_the_parent_that_they_belong_to():
    """The diamond's channels pinch at 0.35 of the cell, P's at 0.47: 3.2 mm are too much for the one and not for the other."""
    both = graded.transition(tpms.schwarz_d(cell=U), PRIMITIVE, plane=PLANE, width=4, over=BOX)
    again = graded.transition(both, GYROID, plane=((20, 0, 0), "x"), width=2, over=BOX)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        both.sheet(graded.linear("x", 0, 24, 1.0, 3.6))
        both.sheet(lambda x, y, z: 1 + 0.1 * x)
        again.sheet(graded.linear("x", 0, 24, 1.0, 3.4))
        both.solid(graded.linear("x", 0, 24, 0.0, 1.8))
    for call, wall, name in [
        (lambda: both.sheet(graded.linear("x", 0, 24, 3.2, 1.0)), "3.2", "schwarz_d"),
        (lambda: both.sheet(lambda x, y, z: 3.2 - 0.05 * x), "3.2", "schwarz_d"),
        (lambda: both.sheet(graded.linear("x", 0, 24, 1.0, 4.0)), "4", "schwarz_p"),
        (lambda: again.sheet(graded.linear("x", 0, 24, 1.0, 3.6)), "3.6", "gyroid"),
    ]:
        with pytest.warns(tpms.SealedChannelWarning, match=rf"wall of {wall} mm seals .*{name}"):
            call()
    with pytest.warns(tpms.SealedChannelWarning, match="schwarz_d"):
        both.solid(graded.linear("x", 0, 24, 1.5, 0.0))
    mixed = graded.mixture([(tpms.schwarz_d(cell=U), (0, 6, 6)), (PRIMITIVE, (24, 6, 6))], sharpness=0.02, over=BOX)
    with pytest.warns(tpms.SealedChannelWarning, match="schwarz_d"):
        mixed.sheet(graded.linear("x", 0, 24, 3.2, 1.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # What a law does not know beyond the part is not asked for yet.
        both.sheet(0.5 * frep.sqrt(X - 6))
        both.sheet(frep.foreign(lambda x, y, z: np.where(x < 20, 1.0, np.nan)))
    with pytest.warns(tpms.SealedChannelWarning, match="gyroid"):
        tpms.gyroid(cell=U, over=BOX).sheet(lambda x, y, z: 1 + 0.15 * x)


def test_ranges_mix_as_ranges():
    first, second = tpms.gyroid(cell=U, scale="range"), tpms.schwarz_p(cell=U, scale="range")
    mixed = first.blended(second, 0.3)
    np.testing.assert_allclose(mixed.value(POINTS), 0.7 * first.value(POINTS) + 0.3 * second.value(POINTS), atol=1e-9)


@pytest.mark.parametrize("width", [0.0, 3.0])
def test_three_surfaces_by_nesting(width):
    """Where no zone is, each of the three is as it would be alone: the same sides, and with zones the same numbers."""
    box = ((0, 0, 0), (30, 8, 8))
    third = tpms.schwarz_d(cell=U)
    pair = graded.transition(GYROID, PRIMITIVE, plane=((9, 0, 0), "x"), width=width, over=box)
    wall = graded.transition(pair, third, plane=((21, 0, 0), "x"), width=width, over=box).sheet(0.8).field
    points = RNG.uniform(*box, (4000, 3))
    for alone, low, high in ((GYROID, 0, 9), (PRIMITIVE, 9, 21), (third, 21, 30)):
        own = points[(points[:, 0] > low + width / 2) & (points[:, 0] < high - width / 2)]
        expected = alone.sheet(0.8).field(own)
        np.testing.assert_array_equal(wall(own) < 0, expected < 0)
        if width:
            np.testing.assert_allclose(wall(own), expected, atol=1e-12)


def test_surfaces_across_a_curved_border():
    border = frep.sqrt((X - 12) ** 2 + (Y - 6) ** 2 + (Z - 6) ** 2) - 5
    both = graded.transition(GYROID, PRIMITIVE, field=border, width=2)
    far = np.abs(border(POINTS)) > 1
    expected = np.where(border(POINTS) < 0, GYROID.distance(POINTS), PRIMITIVE.distance(POINTS))
    np.testing.assert_array_equal(both.value(POINTS)[far], expected[far])


# --- solids ----------------------------------------------------------------------------------------------------------------


def test_solids_morph_by_their_fields():
    first, second = beams.bcc(cell=U).thicken(1.2), GYROID.sheet(0.8)
    part = graded.transition(first, second, plane=PLANE, width=4)
    s = np.clip((POINTS[:, 0] - MIDDLE) / 4 + 0.5, 0, 1)
    w = s * s * (3 - 2 * s)
    np.testing.assert_allclose(part.field(POINTS), (1 - w) * first.field(POINTS) + w * second.field(POINTS), atol=1e-9)
    assert {f.what for f in part.features} == {f.what for f in (*first.features, *second.features)}
    ball, brick = frep.sphere((0, 0, 0), 3), frep.box((1, -1, -1), (9, 1, 1))
    bounded = graded.transition(ball, brick, plane=((2, 0, 0), "x"), width=1)
    np.testing.assert_array_equal(bounded.bounds, [[-3, -3, -3], [9, 3, 3]])


def test_solids_switch_without_a_crack():
    first, second = frep.box((-5, -2, -2), (5, 2, 2)), frep.cylinder((-5, 0, 0), (5, 0, 0), 1.0)
    part = graded.transition(first, second, plane=((0, 0, 0), "x"))
    points = RNG.uniform(-6, 6, (5000, 3))
    np.testing.assert_array_equal(
        part.contains(points), np.where(points[:, 0] < 0, first.contains(points), second.contains(points))
    )
    assert part.contains((0.0, 0.3, 0.3))
    assert part.volume(voxel=0.2) == pytest.approx(5 * 16 + 5 * math.pi, rel=5e-3)
    assert graded.connection_report(part).is_connected


def test_overlaps_hold_where_morphs_part():
    """FCC beams into walls of Schwarz P: weighed fields lose contact, both through the zone keep it."""
    first, second = beams.fcc(cell=U).thicken(1.2), PRIMITIVE.sheet(0.8)
    for width in (0.5 * U, U):
        morph = graded.transition(first, second, plane=PLANE, width=width) & BOX
        both = graded.transition(first, second, plane=PLANE, width=width, how="overlap", blend=0.4) & BOX
        assert graded.connection_report(morph, voxel=0.2).main_share < 0.9
        assert graded.connection_report(both, voxel=0.2).main_share > 0.999
    # Beyond the zone, and away from fillets, each alone.
    points = RNG.uniform(*BOX.bounds, (4000, 3))
    for side, alone in ((points[:, 0] < MIDDLE - U / 2 - 1, first), (points[:, 0] > MIDDLE + U / 2 + 1, second)):
        np.testing.assert_array_equal(both.contains(points[side]), alone.contains(points[side]))


def test_a_morph_that_parts_in_a_box_says_so():
    first, second = beams.fcc(cell=U).thicken(1.2), PRIMITIVE.sheet(0.8)
    with pytest.warns(frep.DisconnectedWarning, match=r'fall into \d+ pieces, .*how="overlap"'):
        part = graded.transition(first, second, plane=PLANE, width=U, over=BOX)
    # A switch in the middle of a cell, where no beam ends.
    with pytest.warns(frep.DisconnectedWarning, match="fall into 2 pieces"):
        graded.transition(first, second, plane=PLANE, over=BOX)
    assert part.report.main_share == pytest.approx(
        graded.connection_report(part & BOX, voxel=part.report.voxel).main_share
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert graded.transition(first, second, plane=PLANE, width=U, over=BOX, how="overlap").report.is_connected
        assert graded.transition(first, second, plane=((16, 0, 0), "x"), over=BOX).report.is_connected
        # Two pieces that were two before.
        thin, thick = GYROID.twin(1.0), GYROID.twin(2.0)
        assert len(graded.transition(thin, thick, plane=PLANE, width=U, over=BOX).report.pieces) >= 2
        # A box too large for its walls to be seen, and one with nothing in it.
        assert graded.transition(first, second, plane=PLANE, width=U, over=((0, 0, 0), (900, 900, 900))).report is None
        empty = frep.sphere((0, 0, 0), 1)
        assert graded.transition(empty, empty, plane=PLANE, width=1, over=((20, 0, 0), (24, 4, 4))).report is None


# --- beams -----------------------------------------------------------------------------------------------------------------


@dataclass
class FakeBeams:
    """What a transition knows of a beam lattice."""

    skeleton: object = None
    seen: dict = field(default_factory=dict)

    def assembled(self, parts, **options):
        self.seen = {"parts": parts, **options}
        return self


def test_beams_are_assembled_on_both_sides():
    first, second = FakeBeams(), FakeBeams()
    whole = graded.transition(first, second, plane=PLANE, over=BOX, bridge="nearest", width=2)
    (a, left), (b, right) = whole.seen["parts"]
    assert (a, b) == (first, second)
    assert whole.seen["over"] is BOX
    assert whole.seen["bridge"] == "nearest"
    np.testing.assert_array_equal(left.contains(POINTS), POINTS[:, 0] < MIDDLE - 1)
    np.testing.assert_array_equal(right.contains(POINTS), POINTS[:, 0] > MIDDLE + 1)


def test_beam_lattices_become_one_graph():
    box = frep.box((0, 0, 0), (20, 10, 10))
    whole = graded.transition(beams.bcc(cell=5), beams.simple_cubic(cell=5), plane=((10, 0, 0), "x"), over=box)
    nodes = whole.skeleton.nodes
    assert len(nodes) == len(np.unique(np.round(nodes, 9), axis=0))
    part = whole.thicken(1.0) & box
    points = RNG.uniform((0, 0, 0), (20, 10, 10), (4000, 3))
    clear = np.abs(points[:, 0] - 10) > 0.6
    # Half balls at the ends may differ at the outer faces.
    clear &= np.all((points > 0.6) & (points < (19.4, 9.4, 9.4)), axis=1)
    expected = np.where(
        points[:, 0] < 10,
        beams.bcc(cell=5).thicken(1.0).contains(points),
        beams.simple_cubic(cell=5).thicken(1.0).contains(points),
    )
    np.testing.assert_array_equal(part.contains(points)[clear], expected[clear])
    assert whole.report is not None


# --- regions and mixtures ----------------------------------------------------------------------------------------------------


def three_ways(gap: float = 0.0) -> list[Solid]:
    """Thirds of space round the z axis through (12, 6): three half planes of borders meet in it."""
    thirds = []
    for k in range(3):
        a, b = math.tau * k / 3, math.tau * (k + 1) / 3
        start = Solid(math.sin(a) * (X - 12) - math.cos(a) * (Y - 6) + gap / 2)
        stop = Solid(-math.sin(b) * (X - 12) + math.cos(b) * (Y - 6) + gap / 2)
        thirds.append(start & stop)
    return thirds


def test_three_regions_tile_and_keep_their_surfaces():
    surfaces = [GYROID, PRIMITIVE, tpms.schwarz_d(cell=U)]
    places = three_ways()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        whole = graded.regions(list(zip(surfaces, places, strict=True)), over=BOX)
    assert whole.report.tiles
    for surface, place in zip(surfaces, places, strict=True):
        own = POINTS[place.contains(POINTS)]
        np.testing.assert_array_equal(whole.sheet(0.8).contains(own), surface.sheet(0.8).contains(own))
    soft = graded.regions(list(zip(surfaces, places, strict=True)), over=BOX, width=2)
    for surface, place in zip(surfaces, places, strict=True):
        own = POINTS[place.field(POINTS) < -2]
        np.testing.assert_array_equal(soft.sheet(0.8).field(own), surface.sheet(0.8).field(own))


def test_three_regions_of_solids():
    solids = [frep.sphere((12, 6, 6), r) for r in (3.0, 4.0, 5.0)]
    whole = graded.regions(list(zip(solids, three_ways(), strict=True)), over=BOX)
    expected = sum(4 / 9 * math.pi * r**3 for r in (3, 4, 5))
    assert whole.volume(voxel=0.2) == pytest.approx(expected, rel=5e-3)
    assert graded.connection_report(whole).is_connected
    assert whole.mesh(voxel=0.25).check().closed


def test_gaps_and_overlaps_are_reported():
    solids = [frep.sphere((12, 6, 6), 5.0)] * 3
    # Strips of the three borders within the box, which are 12, 6 / cos 30 and 6 / cos 30 mm long.
    strips = 12 + 2 * 6 / math.cos(math.pi / 6)
    for gap, name in ((0.5, "gap"), (-0.5, "overlap")):
        with pytest.warns(RegionWarning, match=f"{name} of"):
            whole = graded.regions(list(zip(solids, three_ways(gap), strict=True)), over=BOX)
        assert getattr(whole.report, name) == pytest.approx(strips * 0.5 * 12, rel=0.05)
        place = getattr(whole.report, f"{name}_place")
        depths = sorted(p.field(place) for p in three_ways(gap))
        assert depths[0] > 0 if name == "gap" else depths[1] < 0
        # Nothing in a gap.
        free = np.min([p.field(POINTS) for p in three_ways(gap)], axis=0) > 1e-3
        assert not whole.contains(POINTS[free]).any()


def test_mixtures_are_gaussian_means_of_levels():
    surfaces = [GYROID, PRIMITIVE, tpms.iwp(cell=U)]
    centres = np.array([[0.0, 0, 0], [24, 12, 0], [12, 0, 12]])
    sharpness = 0.02
    mixed = graded.mixture(list(zip(surfaces, centres.tolist(), strict=True)), sharpness=sharpness)
    weights = np.exp(-sharpness * ((POINTS[:, None] - centres) ** 2).sum(-1))
    levels = np.stack([s.level(POINTS) / s.steepness for s in surfaces], 1)
    np.testing.assert_allclose(mixed.level(POINTS), (weights * levels).sum(1) / weights.sum(1), atol=1e-9)
    solids = [frep.sphere(c, 3) for c in centres]
    whole = graded.mixture(list(zip(solids, centres.tolist(), strict=True)), sharpness=0.3)
    for solid, centre in zip(solids, centres, strict=True):
        near = centre + RNG.uniform(-1, 1, (50, 3))
        np.testing.assert_allclose(whole.field(near), solid.field(near), atol=1e-6)


# --- reports -----------------------------------------------------------------------------------------------------------------


def test_connection_report_counts_places_and_volumes():
    balls = [((0, 0, 0), 2.0), ((6, 0, 0), 1.5), ((0, 7, 1), 1.0)]
    part = frep.union(*(frep.sphere(c, r) for c, r in balls))
    report = graded.connection_report(part, voxel=0.1)
    assert not report.is_connected
    for piece, (centre, radius) in zip(report.pieces, balls, strict=True):
        assert piece.volume == pytest.approx(4 / 3 * math.pi * radius**3, rel=0.02)
        assert np.linalg.norm(np.subtract(piece.place, centre)) < radius - 0.2
    assert str(report).startswith("3 pieces: ")
    joined = part | frep.capsule((0, 0, 0), (6, 0, 0), 0.5) | frep.capsule((0, 0, 0), (0, 7, 1), 0.5)
    assert graded.connection_report(joined).is_connected
    assert str(graded.connection_report(joined)).startswith("one piece")


# --- bad input ---------------------------------------------------------------------------------------------------------------

G, P, S, B = GYROID, PRIMITIVE, GYROID.sheet(0.8), beams.bcc(cell=5)
HALVES = [(G, frep.half_space((1, 0, 0))), (P, ~frep.half_space((1, 0, 0)))]
BAD = [
    ("plane, field", ArgumentError, lambda: graded.transition(G, P)),
    ("plane, field", ArgumentError, lambda: graded.transition(G, P, plane=PLANE, field=X)),
    ("plane", ArgumentTypeError, lambda: graded.transition(G, P, plane=(0, 0, 1))),
    ("plane", ArgumentTypeError, lambda: graded.transition(G, P, plane=5)),
    ("plane", ArgumentError, lambda: graded.transition(G, P, plane=((0, 0, 0), (0, 0, 0)))),
    ("field", ArgumentError, lambda: graded.transition(G, P, field=3)),
    ("width", ArgumentError, lambda: graded.transition(G, P, plane=PLANE, width=-1)),
    ("width", ArgumentTypeError, lambda: graded.transition(G, P, plane=PLANE, width=X)),
    ("smoothstep", ArgumentError, lambda: graded.transition(G, P, plane=PLANE, width=1, profile="smothstep")),
    (
        "over",
        frep.UnboundedError,
        lambda: graded.transition(G, P, plane=PLANE, width=1, over=frep.half_space((0, 0, 1))),
    ),
    ("over", ArgumentError, lambda: graded.transition(B, B, plane=PLANE)),
    ("bridge", ArgumentError, lambda: graded.transition(B, B, plane=PLANE, over=BOX, width=1)),
    ("bridge", ArgumentError, lambda: graded.transition(G, P, plane=PLANE, bridge="nearest")),
    ("thicken", ArgumentError, lambda: graded.transition(B, S, plane=PLANE)),
    ("sheet", ArgumentError, lambda: graded.transition(S, P, plane=PLANE)),
    ("second", ArgumentTypeError, lambda: graded.transition(S, 3, plane=PLANE)),
    ("how", ArgumentError, lambda: graded.transition(S, S, plane=PLANE, how="mix")),
    ("how", ArgumentError, lambda: graded.transition(G, P, plane=PLANE, how="overlap", width=1)),
    ("width", ArgumentError, lambda: graded.transition(S, S, plane=PLANE, how="overlap")),
    ("blend", ArgumentError, lambda: graded.transition(S, S, plane=PLANE, width=1, blend=0.5)),
    ("blend", ArgumentError, lambda: graded.transition(G, P, plane=PLANE, width=1, blend=X)),
    ("field", frep.FunctionError, lambda: graded.transition(G, P, field=frep.sqrt(X - 30), width=2, over=BOX)),
    ("other", ArgumentTypeError, lambda: G.blended(S, 0.5)),
    ("share", ArgumentError, lambda: G.blended(P, 1.5)),
    ("over", frep.UnboundedError, lambda: G.blended(P, 0.5, over=frep.half_space((0, 0, 1)))),
    ("over", ArgumentError, lambda: G.blended(P, frep.clip(X, 0, 1)).distance),
    ("parts", ArgumentError, lambda: graded.regions([], over=BOX)),
    ("parts[1]", ArgumentTypeError, lambda: graded.regions([HALVES[0], (P, 3)], over=BOX)),
    ("parts[0]", ArgumentTypeError, lambda: graded.regions([G, P], over=BOX)),
    ("over", frep.UnboundedError, lambda: graded.regions(HALVES, over=frep.half_space((0, 0, 1)))),
    ("width", ArgumentError, lambda: graded.regions(HALVES, over=BOX, width=-1)),
    ("profile", ArgumentError, lambda: graded.regions(HALVES, over=BOX, width=1, profile="cubic")),
    ("bridge", ArgumentError, lambda: graded.regions(HALVES, over=BOX, bridge="nearest")),
    ("sharpness", ArgumentError, lambda: graded.mixture([(G, (0, 0, 0)), (P, (9, 0, 0))], sharpness=0)),
    ("centre", ArgumentError, lambda: graded.mixture([(G, (0, 0, 0)), (P, (0, 0, 0))], sharpness=1)),
    ("parts", ArgumentError, lambda: graded.mixture([(G, (0, 0, 0))], sharpness=1)),
    ("thicken", ArgumentError, lambda: graded.mixture([(B, (0, 0, 0)), (B, (9, 0, 0))], sharpness=1)),
    ("solid", ArgumentTypeError, lambda: graded.connection_report(G)),
    ("infinite", frep.UnboundedError, lambda: graded.connection_report(S)),
]


@pytest.mark.parametrize(("named", "error", "call"), BAD)
def test_bad_input_says_what_is_expected(named, error, call):
    with pytest.raises(error) as found:
        call()
    assert named in str(found.value)
