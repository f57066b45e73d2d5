"""Laws: closed forms, constant beyond the ends, any direction, Fields as ends, clear refusals; distance to a solid."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frep
from frep import ArgumentError, ArgumentTypeError
from graded import (
    at_foot,
    at_nodes,
    axial,
    distance_to,
    linear,
    parabola,
    per_cell,
    piecewise,
    power,
    radial,
    sine,
    smoothstep,
    step,
    table,
)
from graded.laws import parabola_thesis
from graded.sampling_rules import along_beams
from topologies import beams

X, Y, Z = frep.coordinates()
POINTS = np.random.default_rng(4).uniform(-30, 30, (500, 3))
numbers = st.floats(-100, 100)


@given(st.sampled_from("xyz"), numbers, numbers, numbers, numbers)
def test_linear_interpolates_between_its_ends(axis, start, stop, low, high):
    if abs(stop - start) < 1e-3:
        return
    law = linear(axis, start, stop, low, high)
    expected = np.interp(POINTS[:, "xyz".index(axis)], *zip(*sorted([(start, low), (stop, high)]), strict=True))
    np.testing.assert_allclose(frep.as_field(law)(POINTS), expected, atol=1e-9)


@given(numbers, st.floats(0.1, 100), numbers, numbers)
def test_parabola_has_its_ends_and_its_middle(start, length, ends, middle):
    law = parabola("y", start, start + length, ends, middle)
    s = np.clip((POINTS[:, 1] - start) / length, 0, 1)
    expected = ends + 4 * (middle - ends) * s * (1 - s)
    np.testing.assert_allclose(frep.as_field(law)(POINTS), expected, atol=1e-9)


def test_parabola_reaches_its_middle_and_does_not_exceed_it():
    """The thesis' own formula (4.1) peaks at 7 for 1 and 6 (lf-rep O10); the corrected one at 6."""
    law = parabola("x", 0, 200, ends=1, middle=6)
    values = law(np.stack([np.linspace(-50, 250, 3001), np.zeros(3001), np.zeros(3001)], axis=1))
    assert values.max() == pytest.approx(6.0)
    assert values.min() == pytest.approx(1.0)
    # Means over the length: 1 + 2/3 * 5.
    inside = law(np.stack([np.linspace(0, 200, 20001), np.zeros(20001), np.zeros(20001)], axis=1))
    assert inside.mean() == pytest.approx(1 + 2 / 3 * 5, rel=1e-3)


def test_the_parabola_of_the_thesis_peaks_at_the_sum():
    """O10: with 1 and 6, D(0) = D(1) = 1, D(1/2) = 7, mean 5, mean square 28.2."""
    law = parabola_thesis("x", 0, 1, 1, 6)
    assert law([[0, 0, 0], [0.5, 0, 0], [1, 0, 0]]).tolist() == [1, 7, 1]
    x = (np.arange(1000) + 0.5) / 1000
    values = law(np.stack([x, x, x], axis=1))
    np.testing.assert_allclose(values, -4 * 6 * (x - 0.5) ** 2 + 6 + 1, atol=1e-12)
    assert values.mean() == pytest.approx(5, abs=1e-4)
    assert (values**2).mean() == pytest.approx(28.2, abs=1e-3)


@pytest.mark.parametrize("exponent", [0.01, 0.3, 2.5, 40.7])
def test_a_power_is_nothing_at_its_start(exponent):
    law = power("x", 0, 10, 1, 2, exponent)
    x = np.array([-1.0, 0.0, 1e-6, 2.5, 10.0])
    np.testing.assert_allclose(law(np.stack([x, x, x], axis=1)), 1 + (np.clip(x, 0, 10) / 10) ** exponent, rtol=1e-6)
    assert law.bounds((-5, 0, 0), (0, 1, 1))[1] == pytest.approx(1)


def test_laws_come_as_an_array_too():
    law = piecewise("x", np.array([1, 2]), np.array([1.0, 2.0, 3.0]))
    assert law([[0, 0, 0], [1.5, 0, 0], [3, 0, 0]]).tolist() == [1, 2, 3]


@pytest.mark.parametrize(
    ("meant", "call"),
    [
        ("'x'", lambda: linear("X", 0, 1, 1, 2)),
        ("'normalised'", lambda: linear("x", 0, 1, 1, 2, coordinates="normalized")),
        ("'cell'", lambda: linear("x", 0, 1, 1, 2, sample="cells", cell=3)),
        ("'coordinates'", lambda: linear("x", 0, 1, 1, 2, coordinate="cell")),  # type: ignore[call-arg]
    ],
)
def test_unknown_names_suggest_the_nearest(meant, call):
    with pytest.raises((ArgumentError, ArgumentTypeError), match=f"did you mean {meant}"):
        call()


def test_ends_are_clamped():
    law = linear("z", 10, 20, 1, 3)
    np.testing.assert_array_equal(law([[0, 0, -1e9], [0, 0, 10], [0, 0, 20], [0, 0, 1e9]]), [1, 1, 3, 3])
    curve = parabola("z", 10, 20, 1, 3)
    np.testing.assert_array_equal(curve([[0, 0, -1e9], [0, 0, 15], [0, 0, 1e9]]), [1, 3, 1])


def test_reversed_laws_mirror():
    np.testing.assert_allclose(linear("x", 20, -5, 3, 1)(POINTS), linear("x", -5, 20, 1, 3)(POINTS), atol=1e-12)
    np.testing.assert_allclose(parabola("x", 20, -5, 3, 1)(POINTS), parabola("x", -5, 20, 3, 1)(POINTS), atol=1e-12)


def test_any_field_is_an_axis_and_any_field_an_end():
    radius = frep.hypot(X, Y)
    law = linear(radius, 2, 8, 1.0, 1.0 + 0.1 * Z)
    s = np.clip((np.hypot(POINTS[:, 0], POINTS[:, 1]) - 2) / 6, 0, 1)
    np.testing.assert_allclose(law(POINTS), 1 + 0.1 * POINTS[:, 2] * s, atol=1e-9)
    np.testing.assert_allclose(linear(lambda x, y, z: x, 0, 9, 1, 2)(POINTS), linear("x", 0, 9, 1, 2)(POINTS))


def test_bounds_of_the_laws_enclose():
    for law in (linear("x", 0, 10, 1, 3), parabola("x", 0, 10, 1, 6)):
        low, high = law.bounds((-100, -100, -100), (100, 100, 100))
        values = law(POINTS)
        assert low <= values.min()
        assert high >= values.max()
        assert low > 0, "a law that is positive is seen to be so, or every part would be searched for zeros"


def test_distance_to_a_solid_is_positive_on_both_sides():
    ball = distance_to(frep.sphere((1, 2, 3), 5))
    np.testing.assert_allclose(ball(POINTS), np.abs(np.linalg.norm(POINTS - (1, 2, 3), axis=1) - 5), atol=1e-12)
    cube = distance_to(frep.box((-1, -1, -1), (1, 1, 1)))
    np.testing.assert_allclose(cube([[0, 0, 0], [0, 0.5, 0], [4, 5, 1]]), [1, 0.5, 5], atol=1e-12)


def test_a_wall_graded_by_the_distance_to_a_solid():
    depth = distance_to(frep.box((0, 0, 0), (20, 20, 20)))
    law = linear(depth, 0, 10, 3.0, 1.0)
    np.testing.assert_allclose(law([[10, 10, 0], [10, 10, 5], [10, 10, 10]]), [3, 2, 1], atol=1e-12)


BAD = [
    ("axis", ArgumentError, lambda f: f("w", 0, 1, 1, 2)),
    ("axis", ArgumentTypeError, lambda f: f(None, 0, 1, 1, 2)),
    ("axis", ArgumentTypeError, lambda f: f((1, 0, 0), 0, 1, 1, 2)),
    ("start", ArgumentError, lambda f: f("x", 5, 5, 1, 2)),
    ("start", ArgumentError, lambda f: f("x", math.nan, 5, 1, 2)),
    ("stop", ArgumentError, lambda f: f("x", 0, math.inf, 1, 2)),
    ("start", ArgumentTypeError, lambda f: f("x", X, 1, 1, 2)),
    ("stop", ArgumentTypeError, lambda f: f("x", 0, "end", 1, 2)),
    ("low|ends", ArgumentTypeError, lambda f: f("x", 0, 1, "thin", 2)),
    ("high|middle", ArgumentError, lambda f: f("x", 0, 1, 1, math.nan)),
    ("high|middle", ArgumentTypeError, lambda f: f("x", 0, 1, 1, None)),
]


@pytest.mark.parametrize("law", [linear, parabola])
@pytest.mark.parametrize(("argument", "error", "call"), BAD)
def test_bad_input_names_the_argument(law, argument, error, call):
    with pytest.raises(error, match=rf"\b({argument})\b"):
        call(law)


def test_distance_to_needs_a_solid():
    with pytest.raises(ArgumentTypeError, match="solid"):
        distance_to(X)


# --- the other laws ------------------------------------------------------------------------------------------------------

S = np.clip((POINTS[:, 0] + 20) / 40, 0, 1)
CLOSED_FORMS = [
    (sine("x", 4, 3, period=20), 4 + 3 * np.sin(2 * np.pi * POINTS[:, 0] / 20)),
    (sine("y", 4, 3, 10, phase=math.pi / 2), 4 + 3 * np.cos(2 * np.pi * POINTS[:, 1] / 10)),
    (power("x", -20, 20, 1, 5, 3), 1 + 4 * S**3),
    (power("x", -20, 20, 1, 5, 0.5), 1 + 4 * np.sqrt(S)),
    (power("x", -20, 20, 1, 5, 1.7), 1 + 4 * S**1.7),
    (smoothstep("x", -20, 20, 5, 1), 5 - 4 * (3 * S**2 - 2 * S**3)),
    (step("x", 3, 1, 2), np.where(POINTS[:, 0] < 3, 1.0, 2.0)),
    (
        piecewise("x", [-10, 0, 10], [1, X, 3, 4]),
        np.select([POINTS[:, 0] < k for k in (-10, 0, 10)], [1, POINTS[:, 0], 3], 4),
    ),
    (radial((1, 2, 3), 0, 20, 1, 2), 1 + np.clip(np.linalg.norm(POINTS - (1, 2, 3), axis=1) / 20, 0, 1)),
    (radial((1, 2, 3), 5, 20, 1, 2, axis="z"), 1 + np.clip((np.hypot(*(POINTS - (1, 2, 3))[:, :2].T) - 5) / 15, 0, 1)),
    (axial((1, 2, 3), (1, 1, 0), 0, 9, 1, 2), 1 + np.clip((POINTS - (1, 2, 3)) @ (1, 1, 0) / math.sqrt(2) / 9, 0, 1)),
    (table("x", [-10, 0, 20], [1, 5, 2]), np.interp(POINTS[:, 0], [-10, 0, 20], [1, 5, 2])),
]


@pytest.mark.parametrize(("law", "expected"), CLOSED_FORMS)
def test_laws_have_their_closed_forms(law, expected):
    np.testing.assert_allclose(law(POINTS), expected, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("law", [law for law, _ in CLOSED_FORMS] + [parabola("x", -20, 20, 6, 1)])
def test_bounds_enclose_and_gradients_match_differences(law):
    rng = np.random.default_rng(1)
    lo = rng.uniform(-30, 30, (40, 3))
    hi = lo + rng.uniform(0, 20, (40, 3))
    low, high = law.bounds(lo, hi)
    for t in rng.uniform(0, 1, (20, 40, 3)):
        values = law(lo + t * (hi - lo))
        assert np.all(values >= low - 1e-9)
        assert np.all(values <= high + 1e-9)
    h = 1e-5
    steps = h * np.eye(3)
    difference = np.stack([(law(POINTS + d) - law(POINTS - d)) / (2 * h) for d in steps], axis=1)
    # A crease or a jump within a step of a point has no one slope.
    close = np.abs(law.gradient(POINTS) - difference).max(axis=1) < 1e-4
    assert close.mean() > 0.99


@pytest.mark.parametrize(
    ("law", "least", "most"),
    [
        (parabola("x", 0, 9, 6, 1), 1, 6),
        (smoothstep("x", 0, 9, 6, 1), 1, 6),
        (power("x", 0, 9, 1, 6, 0.3), 1, 6),
        (sine("x", 4, 3, 5), 1, 7),
        (table("x", np.arange(100.0), 1 + np.sin(np.arange(100.0)) ** 2), 1, 2),
        (table("x", [0, 1, 5], [1, 3, 4], smooth=True), 1, 4),
        (table("x", [0, 1, 5, 9], [1, 3, 2, 5]), 1, 5),
    ],
)
def test_bounds_over_all_space_are_those_of_the_values(law, least, most):
    """A law that is positive is seen to be so."""
    low, high = law.bounds((-1e6,) * 3, (1e6,) * 3)
    assert least - 1e-6 <= low <= least + 0.01
    assert most - 0.01 <= high <= most + 1e-6


@given(st.lists(st.floats(-50, 50), min_size=2, max_size=60, unique=True), st.randoms(use_true_random=False))
def test_a_table_is_straight_between_its_values(places, random):
    at = np.sort(np.array(places))
    if np.diff(at).min() < 0.5:
        return
    values = np.array([random.uniform(1, 9) for _ in at])
    found = table("x", at, values)(POINTS)
    # Long tables are samples: off by a quarter of a sample beside a bend.
    np.testing.assert_allclose(found, np.interp(POINTS[:, 0], at, values), atol=1e-9 if len(at) <= 32 else 0.3)


def test_a_long_even_table_is_exact_to_float32():
    at = np.linspace(-30, 30, 201)
    values = np.cos(at)
    np.testing.assert_allclose(table("y", at, values)(POINTS), np.interp(POINTS[:, 1], at, values), atol=1e-6)


def test_a_smooth_table_is_the_monotone_cubic():
    from scipy.interpolate import PchipInterpolator

    at, values = [-20, -10, 0, 15, 20], [0, 1, 1, 8, 9]
    law = table("x", at, values, smooth=True)
    expected = PchipInterpolator(at, values)(np.clip(POINTS[:, 0], -20, 20))
    np.testing.assert_allclose(law(POINTS), expected, atol=1e-4)
    line = np.stack([np.linspace(-25, 25, 2001), np.zeros(2001), np.zeros(2001)], axis=1)
    assert np.all(np.diff(law(line)) >= -1e-6)


# --- coordinates and sampling ----------------------------------------------------------------------------------------------


def test_normalised_coordinates_run_over_the_body():
    body = frep.box((-5, 0, 10), (15, 4, 50))
    law = linear("z", 0, 1, 0.1, 7, coordinates="normalised", over=body)
    np.testing.assert_allclose(law(POINTS), linear("z", 10, 50, 0.1, 7)(POINTS), atol=1e-12)
    np.testing.assert_allclose(
        linear(X + Z, 0, 2, 1, 2, coordinates="normalised", over=body.bounds)(POINTS),
        1 + np.clip((POINTS[:, 0] + 5) / 20 + (POINTS[:, 2] - 10) / 40, 0, 2) / 2,
        atol=1e-12,
    )


def test_cell_coordinates_count_cells():
    law = linear("y", 0, 3, 1, 2, coordinates="cell", cell=(4, 5, 6))
    np.testing.assert_allclose(law(POINTS), linear("y", 0, 15, 1, 2)(POINTS), atol=1e-12)


def test_sampling_by_cell_is_the_law_at_the_centre():
    law = linear("z", -20, 20, 1, 9)
    by_cell = linear("z", -20, 20, 1, 9, sample="cell", cell=5)
    centres = 5 * (np.floor(POINTS / 5) + 0.5)
    np.testing.assert_allclose(by_cell(POINTS), law(centres), atol=1e-12)
    np.testing.assert_allclose(per_cell(law, 5)(POINTS), law(centres), atol=1e-12)
    moved = per_cell(law, (5, 5, 8), origin=(0, 0, 3))
    np.testing.assert_allclose(moved(POINTS), law(8 * (np.floor((POINTS - 3) / 8) + 0.5) + 3), atol=1e-12)


def test_the_thesis_rule_of_one_value_a_layer():
    """z = (z_a - 1) / (N - 1) for the layers 1..N (LF-rep L1219): the first has the low value, the last the high one."""
    n = 10
    law = linear("z", 0.5, n - 0.5, 0.1, 7, coordinates="cell", cell=20, sample="cell")
    layers = law([[3, 4, 20 * k + 7] for k in range(n)])
    np.testing.assert_allclose(layers, np.linspace(0.1, 7, n), atol=1e-12)


def test_means_of_the_thesis():
    """LF-rep O10: Schwarz P sheets, u = 20, t = 6.9 z + 0.1: mean density 0.3935, and 0.3910 with a value a layer (of 10)."""
    a, chi = 2.3526, -4
    z = np.stack([np.zeros(2000), np.zeros(2000), (np.arange(2000) + 0.5) / 10], axis=1)
    everywhere = linear("z", 0, 1, 0.1, 7, coordinates="normalised", over=((0, 0, 0), (20, 20, 200)))
    layers = linear("z", 0.5, 9.5, 0.1, 7, coordinates="cell", cell=20, sample="cell")
    means = []
    for law in (everywhere, layers):
        tau = law(z) / 20
        means.append(np.mean(a * tau + np.pi * chi / 6 * tau**3))
    np.testing.assert_allclose(means, [0.3935, 0.3910], atol=2e-3)


def test_sampling_changes_nothing_for_a_constant():
    """LF-rep O3."""
    assert per_cell(3.0, 5).is_constant
    assert at_foot(3.0, frep.sphere((0, 0, 0), 5).field).is_constant


def test_nodes_read_the_law_where_they_are():
    graph = beams.graph([(0, 0, 0), (10, 0, 0), (10, 8, 0)], [(0, 1), (1, 2)])
    law = linear("x", 0, 10, 1, 3) + 0.1 * Y
    np.testing.assert_allclose(at_nodes(law, graph), [1, 3, 3.8])
    strut = beams.graph([(0, 0, 0), (10, 0, 0)], [(0, 1)]).thicken(at_nodes(linear("x", 0, 10, 2, 4), graph)[:2])
    assert strut.contains([[9.5, 1.8, 0], [0.5, 1.8, 0]]).tolist() == [True, False]


def test_nodes_of_a_region_of_a_periodic_lattice():
    lattice = beams.bcc(5).rotate("z", 0.4).over(((0, 0, 0), (10, 10, 10)))
    np.testing.assert_allclose(at_nodes(X + 2 * Y, lattice), lattice.skeleton.nodes @ [1, 2, 0])


@pytest.mark.parametrize("tolerance", [0.1, 0.01, 0.001])
@pytest.mark.parametrize(
    "law",
    [
        linear("x", 0, 20, 1, 3),
        linear("x", 3, 11, 1, 3),
        2 + frep.sin(X / 2) * frep.cos(Y),
        1 + 0.1 * frep.hypot(X - 3, Y),
        lambda x, y, z: np.where(x < 7, 1.0, 2.0 + 0.01 * y),
    ],
)
def test_beams_follow_a_law_along_their_axes(law, tolerance):
    """LF-rep 5, "foot": the diameter at every point of an axis, but next to a jump."""
    lattice = beams.diamond(8).over(((0, 0, 0), (16, 16, 8)))
    topology, diameters = along_beams(law, lattice, tolerance=tolerance)
    skeleton, field = topology.skeleton, frep.as_field(law)
    shares = np.linspace(0, 1, 33)
    ends = skeleton.segments()
    points = ends[:, None, 0] + shares[:, None] * (ends[:, 1] - ends[:, 0])[:, None]
    there = field(points.reshape(-1, 3)).reshape(len(ends), -1)
    tapered = diameters[skeleton.edges][:, :1] * (1 - shares) + diameters[skeleton.edges][:, 1:] * shares
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    whole = np.linalg.norm(np.diff(lattice.skeleton.segments(), axis=1)[:, 0], axis=1)
    off = np.abs(there - tapered).max(axis=1)
    # Between the places that are looked at, a law may bend a little more.
    assert np.all((off <= 1.1 * tolerance) | (lengths < 0.0011 * whole.max()))
    np.testing.assert_allclose(diameters, field(skeleton.nodes))
    assert lengths.sum() == pytest.approx(whole.sum())
    np.testing.assert_array_equal(skeleton.nodes[: len(lattice.skeleton.nodes)], lattice.skeleton.nodes)
    assert type(topology) is type(lattice)


def test_beams_get_nodes_only_where_a_law_bends():
    strut = beams.graph([(0, 0, 0), (16, 0, 0), (16, 5, 0)], [(0, 1), (1, 2)])
    assert along_beams(linear("x", -5, 20, 1, 3), strut)[0] is strut
    knee, diameters = along_beams(linear("x", 8, 16, 1, 3), strut)
    np.testing.assert_allclose(knee.skeleton.nodes[3:], [[8, 0, 0]])
    np.testing.assert_allclose(diameters, [1, 3, 3, 1])
    finer = [len(along_beams(1 + (X / 16) ** 2, strut, tolerance=t)[1]) for t in (0.1, 0.01, 0.001)]
    assert finer[0] < finer[1] < finer[2] < 3 + 64


@pytest.mark.parametrize("periods", [2, 4, 8, 16])
def test_a_law_of_many_periods_a_beam_is_not_overlooked(periods):
    """A sine with zeros at every even part of the beam."""
    strut = beams.graph([(0, 0, 0), (16, 0, 0)], [(0, 1)])
    _, diameters = along_beams(2 + frep.sin(periods * math.pi * X / 8), strut)
    assert diameters.max() - diameters.min() > 1.5


def test_a_law_at_the_foot_makes_cones():
    """A straight law: the tapered beam is the sphere-swept cone, whatever is asked of the tolerance."""
    strut = beams.graph([(0, 0, 0), (20, 0, 0)], [(0, 1)])
    topology, diameters = along_beams(linear("x", 0, 20, 1, 4), strut)
    np.testing.assert_allclose(topology.thicken(diameters).field(POINTS), strut.thicken([1, 4]).field(POINTS))


def test_feet_are_constant_along_normals():
    ball = frep.sphere((0, 0, 0), 10)
    law = at_foot(linear("x", -10, 10, 1, 3), ball.field)
    directions = POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True)
    expected = 2 + directions[:, 0]
    np.testing.assert_allclose(law(POINTS), expected, atol=1e-9)


BAD_OPTIONS = [
    ("coordinates", ArgumentError, {"coordinates": "polar"}),
    ("over", ArgumentError, {"coordinates": "normalised"}),
    ("over", ArgumentError, {"over": ((0, 0, 0), (1, 1, 1))}),
    ("over", frep.UnboundedError, {"coordinates": "normalised", "over": frep.half_space((0, 0, 1))}),
    ("over", ArgumentError, {"coordinates": "normalised", "over": ((0, 0, 0), (1, 1, 0))}),
    ("over", ArgumentTypeError, {"coordinates": "normalised", "over": "body"}),
    ("cell", ArgumentError, {"coordinates": "cell"}),
    ("cell", ArgumentError, {"cell": 5}),
    ("cell", ArgumentError, {"sample": "cell"}),
    ("cell", ArgumentError, {"sample": "cell", "cell": -1}),
    ("cell", ArgumentTypeError, {"sample": "cell", "cell": X}),
    ("at_nodes", ArgumentError, {"sample": "node"}),
    ("at_foot", ArgumentError, {"sample": "foot"}),
    ("sample", ArgumentError, {"sample": "edge"}),
    ("within", ArgumentTypeError, {"within": 1}),
]


@pytest.mark.parametrize(("argument", "error", "options"), BAD_OPTIONS)
def test_options_that_do_not_fit_are_refused(argument, error, options):
    for call in (lambda: linear("x", 0, 1, 1, 2, **options), lambda: table("x", [0, 1], [1, 2], **options)):
        with pytest.raises(error, match=rf"\b{argument}\b"):
            call()


@pytest.mark.parametrize(
    ("argument", "error", "call"),
    [
        ("period", ArgumentError, lambda: sine("x", 1, 1, 0)),
        ("phase", ArgumentError, lambda: sine("x", 1, 1, 5, math.inf)),
        ("exponent", ArgumentError, lambda: power("x", 0, 1, 1, 2, -1)),
        ("axis", ArgumentError, lambda: radial((0, 0, 0), 0, 1, 1, 2, axis=(0, 0, 0))),
        ("center", ArgumentError, lambda: axial((0, 0), "x", 0, 1, 1, 2)),
        ("positions", ArgumentError, lambda: piecewise("x", [2, 1], [1, 2, 3])),
        ("laws", ArgumentError, lambda: piecewise("x", [1, 2], [1, 2])),
        (r"laws\[1\]", ArgumentTypeError, lambda: piecewise("x", [1], [1, "b"])),
        ("positions", ArgumentError, lambda: table("x", [0], [1])),
        ("positions", ArgumentError, lambda: table("x", [0, 0], [1, 2])),
        ("positions", ArgumentTypeError, lambda: table("x", "ab", [1, 2])),
        ("values", ArgumentError, lambda: table("x", [0, 1], [1, 2, 3])),
        ("values", ArgumentError, lambda: table("x", [0, 1], [1, math.nan])),
        ("cell", ArgumentError, lambda: per_cell(X, 0)),
        (r"topology.*\.over\(region\)", ArgumentError, lambda: at_nodes(X, beams.bcc())),
        (r"topology.*\.over\(region\)", ArgumentError, lambda: along_beams(X, beams.bcc().translate((1, 0, 0)))),
        ("topology", ArgumentTypeError, lambda: along_beams(X, frep.sphere((0, 0, 0), 1))),
        (
            "tolerance",
            ArgumentError,
            lambda: along_beams(X, beams.graph([(0, 0, 0), (1, 0, 0)], [(0, 1)]), tolerance=0),
        ),
        ("topology", ArgumentTypeError, lambda: at_nodes(X, 5)),
        ("distance", ArgumentTypeError, lambda: at_foot(X, "far")),
        ("distance.*along_beams", ArgumentTypeError, lambda: at_foot(X, beams.bcc())),
    ],
)
def test_bad_input_of_the_other_laws_names_the_argument(argument, error, call):
    with pytest.raises(error, match=argument):
        call()
