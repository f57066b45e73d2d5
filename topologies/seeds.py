"""Seeds of stochastic lattices: random points in a body, uniform, at a least distance, by a density, or relaxed.

Every function takes its `random_state`: a whole number, with which the same seeds come out each time, or a numpy
Generator, which moves on. The body is any bounded Solid; with `periodic=True` it is a `frep.box`, and distances wrap
round it.

scipy's `qmc.PoissonDisk` fills a box, at one distance, without wrapping; bodies and Fields need the darts thrown here.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from frep import ArgumentError, ArgumentTypeError, EmptyError, Field, FieldLike, Solid, as_field, maximum
from frep.arguments import direction, real, refuse_nan, suggestion, width
from frep.solid import require_bounded

if TYPE_CHECKING:
    from scipy.spatial import KDTree

RandomState = int | np.random.Generator
"""What is accepted as a `random_state`."""

Method = Literal["poisson_disk", "uniform"]
"""How seeds are placed: at a least distance, or independent of each other."""

SATURATION = 0.733
"""Balls of radius d / 2 placed at random fill at most 0.3841 of space (Torquato, Uche and Stillinger, Phys. Rev. E 74,
061308, 2006), which is this many centres in d**3."""

FILLING = 0.61
"""Centres in d**3 that `_THROWS` darts leave, away from the surface of the body: measured, periodic, within 0.01."""

_THROWS = 60.0
"""Darts for each seed that saturation would give."""

_TRIES = 400
"""So many times 64 darts are thrown for a place of one ball."""

_MOST = 2_000_000
"""Seeds beyond which a request is taken for a mistake."""

_LLOYD_POINTS = 300
"""Points of the body for each cell, of which Lloyd's centroids are made."""


def generator(random_state: Any) -> np.random.Generator:
    """The numpy Generator that a `random_state` stands for.

    Raises:
        ArgumentTypeError: neither a whole number nor a Generator; None, above all: a lattice must be reproducible.
        ArgumentError: a negative number.
    """
    if isinstance(random_state, np.random.Generator):
        return random_state
    if not isinstance(random_state, int | np.integer) or isinstance(random_state, bool):
        raise ArgumentTypeError(
            f"random_state: expected a whole number >= 0 or a numpy Generator, got {random_state!r}; with the same number "
            "the same lattice comes out"
        )
    if random_state < 0:
        raise ArgumentError(f"random_state: expected a whole number >= 0 or a numpy Generator, got {random_state}")
    return np.random.default_rng(random_state)


def uniform(body: Solid, number: int, *, random_state: RandomState) -> np.ndarray:
    """`number` points spread evenly at random (a binomial process; its Voronoi cells are the Poisson-Voronoi ones).

    Returns:
        (number, 3) points inside the body, mm.

    Raises:
        ArgumentTypeError, ArgumentError: not a bounded Solid, not a whole number from 1 to two millions, no random
            state.
        EmptyError: no material was found in the body.

    Example:
        >>> import frep
        >>> uniform(frep.sphere((0, 0, 0), 5), 4, random_state=1).shape
        (4, 3)
    """
    lo, hi = require_body(body)
    n = sensible(whole(number, "number"), "number")
    random = generator(random_state)
    found, have, tried = [np.zeros((0, 3))], 0, 0
    while have < n:
        darts = random.uniform(lo, hi, (max(1024, 2 * (n - have)), 3))
        inside = darts[body.contains(darts)]
        found.append(inside)
        have, tried = have + len(inside), tried + len(darts)
        if tried > 1_000_000 and have < 1e-5 * tried:
            raise EmptyError(f"body: {have} of {tried:,} random points of its bounds are inside; is it empty?")
    return np.concatenate(found)[:n]


def on_density(body: Solid, density: FieldLike, *, random_state: RandomState) -> np.ndarray:
    """Points at random, so many for each mm3 as `density` says there: a number, a Field or a function of position.

    Their number is itself random unless the density is constant and the body a box.

    Returns:
        (n, 3) points inside the body, mm.

    Raises:
        ArgumentTypeError, ArgumentError: not a bounded Solid, a density that is not positive, no random state.

    Example:
        >>> import frep
        >>> x, y, z = frep.coordinates()
        >>> ball = frep.sphere((0, 0, 0), 10)
        >>> points = on_density(ball, 0.1 * (1 + x / 10), random_state=1)
        >>> bool(points[:, 0].mean() > 1)
        True
    """
    lo, hi = require_body(body)
    law = positive_law(density, "density", "seeds a mm3")
    random = generator(random_state)
    most = law.data if law.is_constant else 1.05 * float(_probed(law, body, "density").max())
    if not most > 0.0:
        raise ArgumentError("density: expected more than 0 seeds a mm3 somewhere in the body")
    while True:
        count = sensible(most * float(np.prod(hi - lo)), "density")
        # Thinning: candidates at the highest density, each kept with its share.
        darts = random.uniform(lo, hi, (count, 3))
        darts = darts[body.contains(darts)]
        share = law(darts)
        if len(share) == 0 or share.max() <= most:
            return darts[random.uniform(0.0, most, len(darts)) < share]
        most = 1.05 * float(share.max())


def poisson_disk(body: Solid, distance: FieldLike, *, random_state: RandomState, periodic: bool = False) -> np.ndarray:
    """Points at random, none closer to another than `distance` mm, so many that few more would find a place.

    Args:
        body: a bounded Solid; with `periodic`, a `frep.box`.
        distance: least distance, mm: a number, a Field or a function of position. Where it varies, two points keep at
            least the smaller of the distances asked for at their places.
        random_state: a whole number or a numpy Generator.
        periodic: distances wrap round the box.

    Returns:
        (n, 3) points inside the body, mm: about `0.61 V / d**3 + 0.17 S / d**2` of them, V and S the body's volume and
        surface (none where periodic). At the surface they lie closer, since none beyond it takes their place; in a thin
        plate their distances are as asked, and there are many times more than its volume alone would have.

    Raises:
        ArgumentTypeError, ArgumentError: not a bounded Solid, not a box, a distance that is not positive, no random
            state.

    Example:
        >>> import frep
        >>> from scipy.spatial.distance import pdist
        >>> bool(pdist(poisson_disk(frep.box((0, 0, 0), (9, 9, 9)), 2, random_state=1)).min() >= 2)
        True
    """
    lo, hi = require_body(body, periodic)
    law = width(distance, "distance")
    random = generator(random_state)
    wrap = hi - lo if periodic else None
    least = law.data if law.is_constant else 0.95 * float(_probed(law, body, "distance").min())
    if not least > 0.0:
        raise ArgumentError(f"distance: expected more than 0 mm everywhere in the body, got {least:g}")
    if periodic and not law.is_constant:
        raise ArgumentTypeError("distance: expected a number in mm where the seeds are periodic, got a Field")
    expected = SATURATION * float(np.prod(hi - lo)) / least**3
    sensible(expected, "distance")
    kept, reach, thrown = np.zeros((0, 3)), np.zeros(0), 0.0
    while thrown < _THROWS * expected:
        # As many darts at a time as there are points: few of them meet each other.
        count = int(np.clip(4 * len(kept), 64, 500_000))
        thrown += count
        darts = random.uniform(lo, hi, (count, 3))
        darts = darts[body.contains(darts)]
        radii = np.full(len(darts), law.data) if law.is_constant else law(darts)
        if not law.is_constant:
            # Thin spots are hit as often as each could take a seed.
            chosen = random.uniform(size=len(darts)) < (least / np.maximum(radii, least)) ** 3
            darts, radii = darts[chosen], radii[chosen]
        if len(kept):
            far = tree_of(kept, lo, wrap).query(folded(darts, lo, wrap))[0] >= radii
            darts, radii = darts[far], radii[far]
        free = _first_come(folded(darts, lo, wrap), radii, wrap)
        kept, reach = np.concatenate([kept, darts[free]]), np.concatenate([reach, radii[free]])
    if not len(kept):
        raise EmptyError("body: no random point of its bounds is inside; is it empty?")
    return kept


def packed_balls(body: Solid, radii: Any, *, random_state: RandomState, periodic: bool = False) -> np.ndarray:
    """Centres of balls of given radii, placed at random, the largest first, so that none meets another.

    As seeds with `weights=radii` each ball lies in its own cell: a foam whose bubbles have a distribution of sizes
    (Redenbach, Comput. Mater. Sci. 44, 1397, 2009).

    Args:
        body: a bounded Solid, in which the centres lie; with `periodic`, a `frep.box`.
        radii: of the balls, mm, one number each, such as `numpy.random.default_rng(1).lognormal(0.5, 0.3, 200)`.
        random_state: a whole number or a numpy Generator.
        periodic: distances wrap round the box.

    Returns:
        (n, 3) centres, in the order of `radii`.

    Raises:
        ArgumentTypeError, ArgumentError: not a bounded Solid, radii that are not positive, no random state, or balls
            that find no place: so placed, equal ones fill at most 38 % of space (their centres may lie at the surface).

    Example:
        >>> import frep
        >>> centres = packed_balls(frep.box((0, 0, 0), (9, 9, 9)), [3, 1, 2], random_state=1)
        >>> bool(((centres[1] - centres[0]) ** 2).sum() >= (3 + 1) ** 2)
        True
    """
    lo, hi = require_body(body, periodic)
    try:
        sizes = np.array(None if isinstance(radii, Field) else radii, dtype=float)
    except (TypeError, ValueError):
        sizes = np.array(np.nan)
    if sizes.ndim != 1 or not len(sizes):
        raise ArgumentTypeError(f"radii: expected a list of radii in mm, got {radii!r}")
    refuse_nan(sizes, "radii", "ball")
    if not np.all(sizes > 0.0):
        ball = int(np.argmax(sizes <= 0.0))
        raise ArgumentError(f"radii: expected more than 0 mm, got {sizes[ball]:g} of ball {ball}")
    sensible(len(sizes), "radii")
    random = generator(random_state)
    wrap = hi - lo if periodic else None
    if wrap is not None and 2.0 * sizes.max() > wrap.min():
        raise ArgumentError(f"radii: a ball of {sizes.max():g} mm meets itself a period of {wrap.min():g} mm on")
    order = np.argsort(-sizes, kind="stable")
    centres = np.empty((len(sizes), 3))
    for k, ball in enumerate(order):
        before = order[:k]
        place = _free_place(body, centres[before], sizes[before] + sizes[ball], wrap, random)
        if place is None:
            asked = 4.0 / 3.0 * math.pi * float((sizes**3).sum() / np.prod(hi - lo))
            raise ArgumentError(
                f"radii: {k} of {len(sizes)} balls were placed, and that of {sizes[ball]:.4g} mm found no place; "
                f"all together would fill {asked:.0%} of the body's bounds, and about a third is what goes; ask for fewer "
                "or smaller ones"
            )
        centres[ball] = place
    return centres


def _free_place(body: Solid, centres, apart, wrap, random: np.random.Generator) -> np.ndarray | None:
    """A random point of the body `apart` from each centre; None if it is not found."""
    lo, hi = body.bounds
    for _ in range(_TRIES):
        darts = random.uniform(lo, hi, (64, 3))
        darts = darts[body.contains(darts)]
        away = darts[:, None] - centres
        if wrap is not None:
            away -= wrap * np.round(away / wrap)
        free = np.flatnonzero(np.all((away**2).sum(axis=2) >= apart**2, axis=1))
        if len(free):
            return darts[free[0]]
    return None


def relaxed(
    body: Solid,
    seeds: Any,
    steps: int,
    *,
    random_state: RandomState,
    cell_size: FieldLike | None = None,
    periodic: bool = False,
) -> np.ndarray:
    """Seeds moved to the centroids of their Voronoi cells, `steps` times (Lloyd): cells grow alike and round.

    Args:
        body: a bounded Solid; with `periodic`, a `frep.box`.
        seeds: (n, 3) points in the body, mm.
        steps: how often; 0 leaves the seeds.
        random_state: a whole number or a numpy Generator. Centroids are those of some 300 random points a cell, so that
            a seed comes to rest within about 3 % of its cell.
        cell_size: the size that cells should keep, mm, where it varies; even without.
        periodic: distances wrap round the box.

    Returns:
        (n, 3) points inside the body. A seed whose centroid lies outside, as in a bend of the body, stays where it is.

    Raises:
        ArgumentTypeError, ArgumentError: not a bounded Solid, seeds outside, steps not a whole number, no random state.
    """
    lo, hi = require_body(body, periodic)
    now = checked_seeds(body, seeds, 1, periodic)
    count = whole(steps, "steps", least=0)
    random = generator(random_state)
    if count == 0:
        return now
    points = uniform(body, min(_LLOYD_POINTS * len(now), 3_000_000), random_state=random)
    # A weight w pulls seeds to a density of w**(3/5) (Du, Faber and Gunzburger, SIAM Review 41, 1999, section 5).
    weight = np.ones(len(points)) if cell_size is None else width(cell_size, "cell_size")(points) ** -5.0
    wrap = hi - lo if periodic else None
    for _ in range(count):
        nearest = tree_of(now, lo, wrap).query(folded(points, lo, wrap), workers=-1)[1]
        away = points - now[nearest]
        if wrap is not None:
            away -= wrap * np.round(away / wrap)
        total = np.bincount(nearest, weight, len(now))
        shift = np.stack([np.bincount(nearest, weight * away[:, a], len(now)) for a in range(3)], axis=1)
        moved = now + shift / np.maximum(total, 1e-300)[:, None]
        moved = moved if wrap is None else lo + np.mod(moved - lo, wrap)
        held = body.contains(moved) if wrap is None else np.ones(len(moved), bool)
        now = np.where(held[:, None], moved, now)
    return now


def random_directions(
    number: int, directions: Any = None, spread: float = 0.0, *, random_state: RandomState
) -> np.ndarray:
    """Unit vectors at random: all over the sphere, or within `spread` rad of one of `directions`, either way round.

    Args:
        number: how many.
        directions: axes ("x", "y", "z" or vectors), each as likely as another; None for any direction.
        spread: half-angle of the cone round each axis, rad, 0 to pi / 2, evenly filled.
        random_state: a whole number or a numpy Generator.

    Returns:
        (number, 3) unit vectors.
    """
    n = whole(number, "number")
    random = generator(random_state)
    half = real(spread, "spread", "rad")
    if not 0.0 <= half <= math.pi / 2 + 1e-9:
        raise ArgumentError(f"spread: expected 0 to pi / 2 rad, got {spread!r}")
    if directions is None:
        v = random.normal(size=(n, 3))
        return v / np.linalg.norm(v, axis=1)[:, None]
    is_list = hasattr(directions, "__len__") and not isinstance(directions, str) and len(directions) > 0
    if not is_list or any(np.ndim(d) == 0 and not isinstance(d, str) for d in directions):
        raise ArgumentTypeError(
            f'directions: expected a list of axes, such as ["z"] or [(0, 0, 1)], got {directions!r}'
        )
    axes = np.array([direction(d, "directions") for d in directions])
    axis = axes[random.integers(len(axes), size=n)] * random.choice([-1.0, 1.0], n)[:, None]
    # Evenly over the cap: its height is uniform (Archimedes).
    cosine = 1.0 - random.uniform(0.0, 1.0 - math.cos(half), n)
    other = np.cross(axis, random.normal(size=(n, 3)))
    other /= np.linalg.norm(other, axis=1)[:, None]
    return cosine[:, None] * axis + np.sqrt(np.maximum(1.0 - cosine**2, 0.0))[:, None] * other


# --- what lattices ask for ----------------------------------------------------------------------------------------


def chosen(
    body, cell_size, density, seeds, random_state, method, relax, periodic, *, least
) -> tuple[np.ndarray, float]:
    """The seeds that the arguments of a lattice ask for, and the side of its smallest cell, mm."""
    lo, hi = require_body(body, periodic)
    given = [name for name, v in (("cell_size", cell_size), ("density", density), ("seeds", seeds)) if v is not None]
    if len(given) != 1:
        raise ArgumentError(f"cell_size, density, seeds: expected one of them, got {' and '.join(given) or 'none'}")
    if method not in ("poisson_disk", "uniform"):
        like = suggestion(method, ("poisson_disk", "uniform"))
        raise ArgumentError(f'method: expected "poisson_disk" or "uniform", got {method!r}{like}')
    steps = whole(relax, "relax", least=0)
    random = generator(random_state) if seeds is None or steps else None
    least = 1 if periodic else least
    size: Field | None = None
    if seeds is not None:
        points = checked_seeds(body, seeds, least, periodic)
    else:
        assert random is not None
        size = _cell_sizes(body, cell_size, density, given[0])
        if periodic and method == "poisson_disk" and not size.is_constant:
            raise ArgumentTypeError(
                f'{given[0]}: expected a number where the lattice repeats; a Field only with method="uniform"'
            )
        points = _placed(body, size, method, random, periodic)
    if len(points) < least:
        raise ArgumentError(
            f"{given[0]}: gives {len(points)} seeds in a body whose bounds are {' x '.join(f'{s:.4g}' for s in hi - lo)} mm; "
            f"expected at least {least}"
        )
    if steps:
        assert random is not None
        law = size if size is not None and not size.is_constant else None
        points = relaxed(body, points, steps, random_state=random, cell_size=law, periodic=periodic)
    mean = float((np.prod(hi - lo) / len(points)) ** (1 / 3))
    smallest = mean if size is None else float(np.min(np.minimum(size(points), mean)))
    return points, smallest


def _cell_sizes(body: Solid, cell_size: FieldLike | None, density: FieldLike | None, name: str) -> Field:
    """The side of a cell, mm, checked to be positive in the body and not to ask for more cells than memory holds."""
    if cell_size is not None:
        law = width(cell_size, name)
    else:
        assert density is not None
        law = positive_law(density, name, "cells a mm3")
    held = np.array([law.data]) if law.is_constant else _probed(law, body, name)
    unit = "mm" if density is None else "cells a mm3"
    low = float(held.min())
    if low < 0.0 or (low == 0.0 and density is None) or not held.max() > 0.0:
        raise ArgumentError(f"{name}: expected more than 0 {unit} everywhere in the body, got {low:.4g}")
    if density is not None:
        # Where there are to be no cells they are very large.
        law = (law if law.is_constant else maximum(law, 1e-9 * float(held.max()))) ** (-1.0 / 3.0)
        held = np.maximum(held, 1e-9 * held.max()) ** (-1.0 / 3.0)
    # Poisson-disk seeds are found among half as many again.
    sensible(1.5 * float(np.prod(np.ptp(body.bounds, axis=0))) / float(held.min()) ** 3, name)
    return law


def _placed(body: Solid, size: Field, method: str, random: np.random.Generator, periodic: bool) -> np.ndarray:
    if method == "uniform":
        return on_density(body, size**-3.0, random_state=random)
    # d so that FILLING centres in d^3 are one in size^3.
    return poisson_disk(body, FILLING ** (1 / 3) * size, random_state=random, periodic=periodic)


# --- checks, shared with `topologies.stochastic` ----------------------------------------------------------------------


def require_body(body: Any, periodic: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """The corners of a bounded Solid's box; with `periodic`, of a `frep.box`."""
    if not isinstance(body, Solid):
        raise ArgumentTypeError(f"body: expected a Solid, got {type(body).__name__}: {body!r}")
    require_bounded(body)
    if periodic and not body._provenance.is_box:
        raise ArgumentError(f"body: expected a frep.box where periodic=True, whose sides are the period; got {body!r}")
    return body.bounds[0], body.bounds[1]


def checked_seeds(body: Solid, seeds: Any, least: int, periodic: bool = False) -> np.ndarray:
    """Seeds as (n, 3) float64, checked to be at least so many, apart from each other (round the period), and inside."""
    if isinstance(seeds, Field):
        raise ArgumentTypeError("seeds: expected an (n, 3) array of points in mm, got a Field")
    try:
        points = np.array(seeds, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentTypeError(
            f"seeds: expected an (n, 3) array of points in mm, got {type(seeds).__name__}"
        ) from None
    if points.ndim != 2 or points.shape[1] != 3:
        raise ArgumentError(f"seeds: expected an (n, 3) array of points in mm, got shape {points.shape}")
    refuse_nan(points, "seeds", "seed")
    if len(points) < least:
        raise ArgumentError(f"seeds: expected at least {least} points, got {len(points)}")
    # On the surface will do: seeds of a lattice lie on the faces of its box.
    outside = np.flatnonzero(body.field(points) > 1e-9 * float(np.ptp(body.bounds, axis=0).max()))
    if len(outside):
        x, y, z = points[outside[0]]
        raise ArgumentError(f"seeds: {len(outside)} of {len(points)} are outside the body, first ({x:g}, {y:g}, {z:g})")
    lo, size = body.bounds[0], np.ptp(body.bounds, axis=0)
    pairs = tree_of(points, lo, size if periodic else None).query_pairs(1e-9 * float(size.max()), output_type="ndarray")
    if len(pairs):
        i, j = pairs[0]
        where = (
            "at the same place, a period apart"
            if np.abs(points[i] - points[j]).max() > 1e-6 * size.max()
            else "at the same place"
        )
        raise ArgumentError(f"seeds: seeds {i} and {j} lie {where}: {points[i].tolist()} and {points[j].tolist()}")
    return points


def whole(value: Any, name: str, least: int = 1) -> int:
    """`value` as an int, checked to be a whole number of at least so much."""
    if not isinstance(value, int | np.integer) or isinstance(value, bool):
        raise ArgumentTypeError(f"{name}: expected a whole number >= {least}, got {value!r}")
    if value < least:
        raise ArgumentError(f"{name}: expected a whole number >= {least}, got {value}")
    return int(value)


def tree_of(points: np.ndarray, lo: np.ndarray, wrap: np.ndarray | None) -> KDTree:
    """A KD-tree of points; where they wrap, it is to be asked with points counted from `lo`, as `folded` gives them."""
    from scipy.spatial import KDTree

    return KDTree(folded(points, lo, wrap), boxsize=wrap)


def folded(points: np.ndarray, lo: np.ndarray, wrap: np.ndarray | None) -> np.ndarray:
    """Points counted from `lo`, in the first period; without one, just the points."""
    if wrap is None:
        return points
    first = np.mod(points - lo, wrap)
    # A tiny negative number comes out as the period itself.
    return np.where(first >= wrap, 0.0, first)


def _first_come(points: np.ndarray, radii: np.ndarray, wrap: np.ndarray | None) -> np.ndarray:
    """Which points stay, taken in their order, when each must keep its radius from those before it."""
    from scipy.spatial import KDTree

    alive = np.ones(len(points), bool)
    if len(points) < 2:
        return alive
    pairs = KDTree(points, boxsize=wrap).query_pairs(float(radii.max()), output_type="ndarray")
    away = points[pairs[:, 0]] - points[pairs[:, 1]]
    if wrap is not None:
        away -= wrap * np.round(away / wrap)
    pairs = np.sort(pairs, axis=1)
    pairs = pairs[np.linalg.norm(away, axis=1) < radii[pairs[:, 1]]]
    for early, late in pairs[np.lexsort(pairs.T[::-1])]:
        if alive[early]:
            alive[late] = False
    return alive


def probes(body: Solid) -> np.ndarray:
    """Points of the body on a grid, at which a law is looked at beforehand."""
    axes = [np.linspace(a, b, 33) for a, b in body.bounds.T]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = points[body.field(points) <= 0.0]
    return inside if len(inside) else points


def _probed(law: Field, body: Solid, name: str) -> np.ndarray:
    """The values of a law on a grid of the body, none of them NaN."""
    points = probes(body)
    values = law(points)
    bad = np.isnan(values)
    if bad.any():
        x, y, z = points[np.argmax(bad)]
        raise ArgumentError(
            f"{name}: expected numbers, it is NaN at {int(bad.sum()):,} of {len(points):,} places in the body, the first "
            f"({x:g}, {y:g}, {z:g}) mm"
        )
    return values


def positive_law(value: FieldLike | Callable[..., Any], name: str, unit: str) -> Field:
    """A law as a Field; a number must be positive."""
    law = as_field(value, name)
    if law.is_constant and not law.data > 0.0:
        raise ArgumentError(f"{name}: expected more than 0 {unit}, got {law.data:g}")
    return law


def sensible(count: float, name: str) -> int:
    """How many are asked for, checked to be no more than memory holds."""
    if count > _MOST:
        raise ArgumentError(f"{name}: asks for {count:,.0f} in the body's bounds; {_MOST:,} are the most")
    return max(1, round(count))
