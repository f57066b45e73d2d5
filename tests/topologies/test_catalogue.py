"""Every entry of the catalogue: it meshes, what is said of it is true, fractions are met, designs don't repeat."""

from __future__ import annotations

import dataclasses
import inspect
import math
import warnings

import numpy as np
import pytest
from scipy.spatial import KDTree

import frep
from frep import ArgumentError
from frep.catalogue import FORMS, Entry, Facts
from topologies import beams, foams, tpms
from topologies.catalogue import ENTRIES, describe, make, names
from topologies.catalogue_entries import source_of, summary_of
from topologies.catalogue_facts import samples, symmetries
from topologies.catalogue_table import KNOWN
from topologies.catalogue_written import table
from topologies.variants import percolates

RNG = np.random.default_rng(11)
X, Y, Z = frep.coordinates()
K = 2.0 * math.pi / 10.0
PERIODIC = [entry for entry in ENTRIES if entry.family in ("beams", "surfaces", "foams")]
SURFACES = [entry for entry in ENTRIES if entry.family == "surfaces"]
every = pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
periodic = pytest.mark.parametrize("entry", PERIODIC, ids=lambda entry: entry.name)
surfaces = pytest.mark.parametrize("entry", SURFACES, ids=lambda entry: entry.name)

# lf-rep 3.1: beams at the nodes of a period.
VALENCES = {
    "simple_cubic": (6,),
    "bcc": (8,),
    "s_fcc": (4, 8),
    "fcc": (4, 12),
    "bccz": (8, 10),
    "fccz": (4, 14),
    "s_fccz": (4, 10),
    "fbcc": (4, 8, 20),
    "s_fbcc": (4, 8, 16),
    "s_fbccz": (4, 8, 18),
    "diamond": (4,),
    "rhombicuboctahedron": (6,),
    "truncated_cube": (5,),
    # Foams by Plateau's rule; dodecahedra of FCC meet in fours and eights; an octet in twelves.
    "truncated_octahedron": (4,),
    "weaire_phelan": (4,),
    "rhombic_dodecahedron": (4, 8),
    "octet": (12,),
    "hexagonal_honeycomb": (5,),
    "triangular_honeycomb": (8,),
    "kagome": (6,),
    "columns": (2,),
    "voronoi": (4,),
}

# Point groups of one side: Schoen 1970, Fischer and Koch 1987 (G I4_132, P Pm-3m, D Fd-3m, S I-43d); nets: textbooks.
GROUPS = {
    "gyroid": "432",
    "schwarz_p": "m-3m",
    "schwarz_d": "m-3m",
    "neovius": "m-3m",
    "iwp": "m-3m",
    "f_rd": "m-3m",
    "fischer_koch_s": "-43m",
    "bcc": "m-3m",
    "bccz": "4/mmm",
    "octet": "m-3m",
    "diamond": "m-3m",
    "weaire_phelan": "m-3m",
    "kelvin": "m-3m",
    "closed_cubes": "m-3m",
    "supported_cubic": "4mm",
    "reentrant": "mmm",
}


@pytest.fixture(autouse=True)
def quiet():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", tpms.LoosePiecesWarning)
        warnings.simplefilter("ignore", tpms.SealedChannelWarning)
        warnings.simplefilter("ignore", frep.errors.ThinWallWarning)
        yield


def wall(entry: Entry) -> str:
    """The form that takes a thickness or diameter; else the first."""
    return next((form for form in entry.forms if FORMS[form] in ("diameter", "thickness")), entry.forms[0])


def sensible(entry: Entry, form: str) -> float:
    low, high = entry.span(form)
    return low + (high - low) * (0.55 if FORMS[form] == "bias" else 0.27)


# --- they mesh -------------------------------------------------------------------------------------------------------


def piece(entry: Entry) -> frep.Solid:
    """A period; of one that holds many cells a corner."""
    block = entry.block(1)
    low, high = block.bounds
    return block & frep.box(
        tuple(low), tuple(np.minimum(high, low + max(1.5 * entry.size, 0.4 * float(max(high - low)))))
    )


@every
def test_every_entry_meshes_closed_at_three_resolutions(entry):
    form = wall(entry)
    part = entry.solid(form, sensible(entry, form)) & piece(entry)
    for cells in (16, 24, 32):
        report = part.mesh(voxel=entry.size / cells).check()
        assert (report.closed, report.manifold, report.oriented) == (True, True, True), cells


@every
def test_every_other_variant_meshes_closed(entry):
    for form in entry.forms:
        if form != wall(entry):
            report = (entry.solid(form, sensible(entry, form)) & piece(entry)).mesh(voxel=entry.size / 20).check()
            assert (report.closed, report.manifold, report.oriented) == (True, True, True), form


# --- what is said of them --------------------------------------------------------------------------------------------


def test_everything_is_listed():
    """Every function that makes a cell of beams, a foam or a surface, by itself."""
    for module, family in ((beams, "beams"), (foams, "foams")):
        made = {
            name
            for name, function in inspect.getmembers(module, inspect.isfunction)
            if function.__module__ == module.__name__
            and not name.startswith("_")
            and list(inspect.signature(function).parameters)[:1] == ["cell"]
        }
        assert made == set(names(family))
    assert set(names("surfaces")) == {*tpms.SURFACES, "primitive_gyroid_diamond", "primitive_neovius"}
    assert {"voronoi", "delaunay", "voronoi_walls", "fibres"} == set(names("stochastic"))
    assert {"spinodal", "perlin", "simplex"} == set(names("noise"))
    assert len(names()) == len(set(names())) == len(ENTRIES)


@periodic
def test_cells_are_cuboid_where_it_is_said(entry):
    said = any(p.name == "cell" and "three for cuboid" in p.help for p in entry.parameters)
    options = {p.name: 0.5 for p in entry.parameters if p.name == "t"}
    if said:
        assert entry.build(cell=(4.0, 6.0, 9.0), **options) is not None
    else:
        with pytest.raises(frep.ArgumentTypeError, match="cell"):
            entry.build(cell=(4.0, 6.0, 9.0), **options)


@every
def test_the_ends_of_every_range_are_taken(entry):
    """The ends of every range of a number are taken, and what is beyond is refused before it is made."""
    options = dict(entry.example)
    options |= {p.name: 0.5 for p in entry.parameters if p.name == "t"}
    for p in entry.parameters:
        if p.low is None and p.high is None:
            continue
        scale = 10.0 if p.of_cell else 1.0
        for end, beyond in ((p.low, -1), (p.high, 1)):
            if end is None or (p.name, end) in (("angle", p.high), ("octaves", p.high), ("relax", p.high)):
                continue  # angles go as far as the cell has room; the others take long
            kind = int if isinstance(p.default, int) or p.name == "number" else float
            if not (p.above and end == p.low):
                assert entry.build(**{**options, p.name: kind(scale * end)}) is not None
            with pytest.raises(ArgumentError, match=rf"^{p.name}\b"):
                entry.build(**{**options, p.name: kind(scale * end + beyond)})


@every
def test_every_entry_is_documented(entry):
    assert entry.summary.endswith(".")
    assert "  " not in entry.summary
    assert entry.source
    assert entry.forms
    for parameter in entry.parameters:
        assert parameter.help, parameter.name
    assert entry.name in str(entry)


def test_summaries_and_sources_are_read_from_docstrings():
    assert source_of(beams.bcc, "bcc") == "LF-rep Table 3.1"
    assert source_of(tpms.scherk, "scherk") == "Scherk 1835"
    assert summary_of(beams.bcc) == "Body-centred cubic: beams from the centre to the eight corners."
    assert summary_of(tpms.schwarz_p) == "Schwarz's P, cos x + cos y + cos z."


@periodic
def test_the_call_makes_the_sample(entry):
    """Run as it stands, it gives the topology that everything else is measured of."""
    head, _, expression = entry.call.partition("; ")
    scope: dict = {}
    exec(head, scope)
    made = eval(expression, scope)
    form = wall(entry)
    points = RNG.uniform(-10, 10, (500, 3))
    expected = entry.solid(form, 1.0).field(points)
    np.testing.assert_allclose(entry.solid(form, 1.0, made).field(points), expected, atol=1e-9)


@every
def test_defaults_are_those_of_the_maker(entry):
    given_ = {p.name: p.default for p in entry.parameters if not p.required}
    if any(p.required for p in entry.parameters) or entry.family in ("noise", "stochastic"):
        given_ |= entry.example
    bare, full = (entry.build(**kw) for kw in (entry.example, given_)) if entry.family != "steady" else (1, 1)
    if entry.family in ("beams", "surfaces", "foams"):
        points = RNG.uniform(-10, 10, (200, 3))
        form = wall(entry)
        np.testing.assert_array_equal(
            entry.solid(form, 1.0, bare).field(points), entry.solid(form, 1.0, full).field(points)
        )


def test_the_range_of_an_angle_goes_with_the_cell():
    """What is said of a cubic cell is true, and a narrower one takes more."""
    assert "pi / 4 in a cubic cell" in str(describe("reentrant"))
    make("reentrant", angle=math.pi / 4 - 1e-3)
    with pytest.raises(ArgumentError, match=r"0\.7854"):
        make("reentrant", angle=math.pi / 4 + 1e-3)
    make("reentrant", cell=(5, 10, 10), angle=1.0)


@periodic
def test_ranges_are_those_of_the_maker(entry):
    """What the catalogue lets pass the maker takes, and what it refuses the maker would."""
    for p in entry.parameters:
        if p.choices:
            for choice in p.choices:
                entry.build(**{**entry.example, p.name: choice})
        if p.high is None:
            continue
        scale = entry.size if p.of_cell else 1.0
        for value in (p.low, p.high):
            if value is not None and not p.above:
                entry.build(**{**entry.example, p.name: scale * value})
        outside = [scale * p.high + 0.01, *([scale * p.low - 0.01] if p.low is not None else [])]
        for value in outside:
            with pytest.raises(ArgumentError, match=p.name):
                entry.build(**{**entry.example, p.name: value})
            if p.name != "t":  # extrapolated by the maker, without end
                with pytest.raises(ArgumentError, match=p.name):
                    entry.make(**{**entry.example, p.name: value})


@every
def test_what_is_written_down_is_found_out_again(entry):
    """The table of what is known against samples; `python -m topologies.catalogue_written` writes it anew."""
    known = entry.known
    assert known is not None
    fresh = dataclasses.replace(entry, known=None, make=lambda **_: entry.sample)
    assert (fresh.forms, fresh.complement_congruent, fresh.valences) == (
        known.forms,
        known.complement_congruent,
        known.valences,
    )
    assert (fresh.period is None) == (known.period is None)
    if known.period is not None:
        np.testing.assert_allclose(fresh.period, known.period, rtol=1e-5)
    assert fresh.size == pytest.approx(entry.size)
    for field in dataclasses.fields(Facts):
        told, found = getattr(known.facts, field.name), getattr(fresh.facts, field.name)
        assert found == (told if isinstance(told, str | None) else pytest.approx(told, rel=2e-3, abs=2e-3)), field.name
    assert set(known.fractions) == set(known.forms)
    for form, shares in known.fractions.items():
        # Where no wall lies on the planes of samples.
        assert fresh.fraction(form, float(entry.widths(form)[5])) == pytest.approx(shares[5], abs=2e-3), form


def test_the_table_is_written_as_it_stands():
    """Of two entries; all of them take a minute."""
    two = [describe("bcc"), describe("perlin")]
    text = table(two)
    scope: dict = {}
    exec(text.replace("from __future__ import annotations", ""), scope)
    assert set(scope["KNOWN"]) == {"bcc", "perlin"}
    for entry in two:
        assert scope["KNOWN"][entry.name].fractions.keys() == KNOWN[entry.name].fractions.keys()
        for form, shares in scope["KNOWN"][entry.name].fractions.items():
            known = np.array(KNOWN[entry.name].fractions[form], float)
            np.testing.assert_allclose(shares, known, atol=1e-3)
    assert max(map(len, text.splitlines())) <= 120


def test_every_entry_is_known_and_none_else():
    assert set(KNOWN) == set(names())


@pytest.mark.parametrize("name", VALENCES)
def test_valences_are_those_known(name):
    assert describe(name).valences == VALENCES[name]


@pytest.mark.parametrize("name", names("beams"))
def test_beams_that_leave_a_node_are_its_valence(name):
    """Round every node, points of a small sphere that lie in thin beams form as many patches as beams meet there."""
    entry = describe(name)
    skeleton = entry.sample.skeleton
    shortest = float(np.linalg.norm(np.diff(skeleton.segments(), axis=1), axis=2).min())
    solid = entry.sample.thicken(0.08 * shortest)
    n = 6000
    k = np.arange(n) + 0.5
    height, turn = 1.0 - 2.0 * k / n, math.pi * (1.0 + 5**0.5) * k
    ring = np.sqrt(1.0 - height**2)
    sphere = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    found = set()
    for node in skeleton.nodes:
        inside = sphere[solid.contains(node + 0.3 * shortest * sphere)]
        pairs = KDTree(inside).query_pairs(0.12, output_type="ndarray")
        group = np.arange(len(inside))
        for _ in range(12):
            for a, b in ((0, 1), (1, 0)):
                np.minimum.at(group, pairs[:, a], group[pairs[:, b]])
        found.add(len(set(group.tolist())))
    assert tuple(sorted(found)) == entry.valences


@pytest.mark.parametrize("name", GROUPS)
def test_point_groups_are_those_known(name):
    entry = describe(name)
    if entry.family == "foams":
        assert symmetries(entry.sample.distance, entry.period)[0] == GROUPS[name]
    assert entry.facts.symmetry == GROUPS[name]


@pytest.mark.parametrize("name", ["hexagonal_honeycomb", "triangular_honeycomb", "kagome", "honeycomb"])
def test_nets_of_hexagons_have_a_sixfold_axis(name):
    """A turn of 60 degrees about the middle of a hexagon, or a node of triangles, changes nothing."""
    entry = describe(name)
    assert entry.facts.symmetry == "6/mmm"
    field = entry.solid(wall(entry), 1.0).field
    grid = np.stack(np.meshgrid(np.arange(0, 10, 0.25), np.arange(0, 17.3205, 17.3205 / 48), indexing="ij"), -1)
    floor = np.column_stack([grid.reshape(-1, 2), np.zeros(grid[..., 0].size)])
    middles = [floor[np.argmax(field(floor))], *(entry.sample.skeleton.nodes if entry.family == "beams" else [])]
    away = RNG.uniform(-10, 10, (400, 3))
    turned = away @ np.array([[0.5, -(0.75**0.5), 0], [0.75**0.5, 0.5, 0], [0, 0, 1.0]])
    wrong = [np.abs(field(m + away) - field(m + turned)).max() for m in middles]
    assert min(wrong) < 1e-6


def test_scherks_tower_turns_upside_down():
    """Half a period on, x and y change places where z changes its sign; and each is mirrored: -42m."""
    field = describe("scherk").sample.level
    p = RNG.uniform(-10, 10, (300, 3))
    swapped = np.column_stack([p[:, 1] + 5.0, p[:, 0] + 5.0, -p[:, 2]])
    np.testing.assert_allclose(field(swapped), field(p), atol=1e-9)
    np.testing.assert_allclose(field(p * (-1, 1, 1)), field(p), atol=1e-9)


@pytest.mark.parametrize(
    ("field", "group", "swapped"),
    [
        (frep.cos(K * X) + 2.0 * frep.cos(K * Y) + 3.0 * frep.cos(K * Z), "mmm", True),
        (frep.cos(K * X) + frep.cos(K * Y) + 3.0 * frep.cos(K * Z) + frep.cos(2.0 * K * Z), "4/mmm", False),
        (frep.cos(K * X) + 2.0 * frep.cos(K * Y) + frep.sin(K * Z) + frep.cos(2.0 * K * Z), "mmm", False),
        (frep.cos(K * X) + 2.0 * frep.cos(K * Y) + frep.sin(K * Z) + frep.sin(2.0 * K * Z), "mm2", True),
        (
            frep.sin(K * X) * frep.sin(K * Y) * frep.sin(K * Z) + 0.1 * frep.cos(2.0 * K * X) * frep.cos(2.0 * K * Y),
            "4/mmm",
            False,
        ),
    ],
    ids=range(5),
)
def test_symmetries_of_known_waves(field, group, swapped):
    """Of sin x sin y sin z a mirror changes the sign, half a period brings it back."""
    assert symmetries(field, (10, 10, 10)) == (group, swapped)


@surfaces
def test_congruent_surfaces_are_their_own_complements(entry):
    """Moved, turned or mirrored, one side is the other one: for those that say so, and for no others."""
    if entry.name == "scherk":
        p = RNG.uniform(-10, 10, (300, 3))
        level = entry.sample.level
        np.testing.assert_allclose(level(p[:, [1, 0, 2]] * (1, 1, -1)), -level(p), atol=1e-9)
        assert entry.complement_congruent
        return
    _, swapped = symmetries(entry.sample.members[0], entry.sample.period)
    assert swapped == entry.complement_congruent
    if entry.complement_congruent:
        low, high = entry.span("solid")
        assert high == pytest.approx(-low, abs=0.01 * entry.size)
        for bias in (0.2 * high, 0.6 * high):
            assert entry.fraction("solid", bias) + entry.fraction("solid", -bias) == pytest.approx(1.0, abs=2e-3)
            assert entry.fraction("inverse", bias) == pytest.approx(entry.fraction("solid", -bias), abs=2e-3)
            assert entry.fraction("sheet", 1.0) == pytest.approx(1.0 - entry.fraction("twin", 1.0), abs=2e-3)


@every
def test_signed_waveforms_part_space_and_others_do_not(entry):
    if entry.family == "steady":
        assert not entry.signed
        return
    assert entry.signed == (entry.family in ("surfaces", "noise"))
    if "inverse" in entry.forms:
        points = RNG.uniform(-10, 10, (2000, 3))
        low, high = entry.span("solid")
        bias = low + 0.6 * (high - low)
        inside = entry.solid("solid", bias).contains(points)
        np.testing.assert_array_equal(inside, ~entry.solid("inverse", bias).contains(points))
        assert 0 < inside.sum() < len(points)


@every
def test_ranges_of_waveforms_are_reached_and_not_passed(entry):
    if entry.facts.range is None:
        return
    level = entry.sample.distance if entry.family == "foams" else entry.sample.level
    low, high = entry.facts.range
    values = level(RNG.uniform(-40, 40, (60_000, 3)))
    assert values.min() >= low - 1e-6 * (high - low)
    assert values.max() <= high + 1e-6 * (high - low)
    if entry.family != "noise":
        assert values.min() < low + 0.05 * (high - low)
        assert values.max() > high - 0.05 * (high - low)


@periodic
def test_limits_are_where_channels_close_and_nothing_is_left(entry):
    """Of a wall or beam; the open part runs on for ever below `pinch`, and is gone above `full`."""
    facts, form = entry.facts, wall(entry)
    assert facts.full is not None
    assert facts.pinch is not None
    assert facts.pinch <= facts.full
    # What is as far from the waveform's zero as half a width is on the edge of a body of that width.
    thin = 0.02 * entry.size
    field = entry.solid(form, thin).field + 0.5 * thin
    if entry.name == "scherk":
        return  # no period in which a channel would close
    away = samples(field, entry.period, 40)
    assert 2.0 * away.max() <= 1.02 * facts.full * entry.size
    assert 2.0 * away.max() > 0.9 * facts.full * entry.size
    if entry.family == "beams":
        assert percolates(away > 0.5 * entry.size * (facts.pinch - 0.05))
        assert not percolates(away > 0.5 * entry.size * (facts.pinch + 0.02))
    elif entry.family == "foams":
        # Walls of two samples, through which no path steps.
        assert percolates(away > 0.04 * entry.size) == (facts.pinch > 0.0)
    else:
        # The two sides of a surface close one after the other.
        signed = entry.sample.distance if "solid" in entry.forms else field
        sides = [samples(sign * signed, entry.period, 40) for sign in (-1.0, 1.0)]
        at = 0.5 * entry.size * facts.pinch
        if facts.pinch > 0.03:
            assert all(percolates(side > at - 0.015 * entry.size) for side in sides)
        assert not all(percolates(side > at + 0.01 * entry.size) for side in sides)


# --- fractions -------------------------------------------------------------------------------------------------------


@every
def test_fractions_grow_with_the_width(entry):
    for form in entry.forms:
        widths, shares = entry.curve(form)
        assert len(widths) >= 7
        assert np.all(np.diff(widths) > 0)
        grows = np.diff(shares) * (-1.0 if form in ("twin", "inverse") else 1.0)
        assert grows.min() > -1e-9, form
        assert grows.max() > 0.05, form


def measured(entry: Entry, solid: frep.Solid) -> float:
    """Volume fraction of a period by `Solid.volume`, its box moved off the planes of symmetry."""
    period = np.asarray(entry.period)
    corner = np.array([0.137, 0.211, 0.309]) * period
    block = frep.box(tuple(corner), tuple(corner + period))
    return (solid & block).volume(voxel=float(period.min()) / 32.0) / float(np.prod(period))


@periodic
def test_fractions_are_those_of_another_measure(entry):
    """What is written down of each form against `Solid.volume` of a period that lies elsewhere."""
    if entry.period is None:
        return  # no period, no fraction
    for form in entry.forms:
        widths, shares = entry.curve(form)
        assert measured(entry, entry.solid(form, float(widths[2]))) == pytest.approx(shares[2], abs=5e-3), form


@pytest.mark.parametrize(
    "name",
    [
        "bcc",
        "fbcc",
        "rhombicuboctahedron",
        "weaire_phelan",
        "kagome",
        "gyroid",
        "iwp",
        "lidinoid",
        "honeycomb",
        "kelvin",
    ],
)
def test_a_fraction_asked_for_is_met(name):
    """By another measure than the one by which the width was found."""
    from graded import thickness_for

    entry = describe(name)
    form = wall(entry)
    law = thickness_for(lambda w: entry.solid(form, w), frep.clip(X, 0.2, 0.45), cell=entry.period)
    for fraction in (0.2, 0.45):
        width = float(law([[fraction, 0.0, 0.0]])[0])
        assert measured(entry, entry.solid(form, width)) == pytest.approx(fraction, abs=5e-3)


# --- made by name ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "given_", "told"),
    [
        ("gyriod", {}, "did you mean 'gyroid'"),
        (3, {}, "no topology 3"),
        ("gyroid", {"cel": 5}, "did you mean 'cell'"),
        ("gyroid", {"scale": "distanse"}, "did you mean 'distance'"),
        ("gyroid", {"drop_x": 2}, "-1 to 1"),
        ("gyroid", {"cell": -1}, "more than 0 mm"),
        ("rhombicuboctahedron", {"tau": 6}, "0 to 0.5 of the cell 10 mm"),
        ("rhombicuboctahedron", {"cell": 4, "tau": 2.1}, "0 to 0.5 of the cell 4 mm"),
        ("columns", {"pattern": "squares"}, "did you mean 'square'"),
        ("primitive_gyroid_diamond", {}, "t: primitive_gyroid_diamond needs it"),
        ("primitive_gyroid_diamond", {"t": 2.5}, "0 to 2"),
        ("voronoi", {"cell_size": 4}, "body: voronoi needs it"),
        ("spinodal", {"cell_size": 5, "random_state": 1, "spread": 4}, "rad"),
    ],
)
def test_what_cannot_be_made_is_told(name, given_, told):
    with pytest.raises(ArgumentError, match=told):
        make(name, **given_)


def test_made_by_name_is_made_by_its_function():
    body = frep.box((0, 0, 0), (10, 10, 10))
    points = RNG.uniform(0, 10, (200, 3))
    by_name = make("voronoi", body=body, cell_size=4, random_state=1).thicken(0.8)
    from topologies import stochastic

    by_hand = stochastic.voronoi(body, cell_size=4, random_state=1).thicken(0.8)
    np.testing.assert_array_equal(by_name.field(points), by_hand.field(points))
    walls = make("voronoi_walls", body=body, cell_size=4, random_state=1).sheet(0.8)
    np.testing.assert_array_equal(
        walls.contains(points), stochastic.voronoi_walls(body, 0.8, cell_size=4, random_state=1).contains(points)
    )
    assert repr(make("reentrant", cell=8, angle=0.4)) == repr(beams.reentrant(8, angle=0.4))
    np.testing.assert_array_equal(make("perlin", cell_size=4, random_state=2).level(points).shape, (200,))


def test_families():
    assert sum(len(names(family)) for family in dict.fromkeys(e.family for e in ENTRIES)) == len(names())
    with pytest.raises(ArgumentError, match="did you mean 'beams'"):
        names("beam")
