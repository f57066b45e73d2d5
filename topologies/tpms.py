"""Triply periodic surfaces, by the formulas of `topologies.waveforms`; most are nodal approximations of minimal surfaces.

A surface has no thickness; its four variants do (`topologies.variants`): `sheet`, `solid`, `inverse`, `twin`. Every
function takes the same natural parameters after the `cell`:

- `cell`: the period in mm, a number or three;
- `phase`: three angles in rad, numbers or Fields, added to those of the formula: 2 pi moves the pattern back by a cell;
- `rotation`: an axis ("x", "y", "z" or a vector) and an angle in rad, about the origin, or a rotation matrix (3, 3);
- `scale`: what bias and thickness are measured in. "distance": the true distance to the surface. "gradient": W / |grad W|,
  the distance to first order, which leaves a thick wall short of material. "range": W, scaled so that its larger extreme is a
  quarter of the cell (LatticeRobot): its zero is where it was, its walls are thin where it is steep;
- `drop_x`, `drop_y`, `drop_z`: numbers or Fields in [-1, 1]: 1 for the formula, 0 to flatten the pattern along that axis, -1 to
  move it by half a period, or to mirror it where the formula has sines;
- `over`: a bounded Solid, or two corners in mm: the box in which scale "distance" is to hold for a surface whose drops, phase
  or `t` vary. The distances are made once, in about 3 s a million nodes, of which a cell has 32 to the third power. A varying
  drop asks for it (or for another scale); without it a varying phase has the distances of the surface before it is moved,
  and a varying `t` those of surfaces a fifth apart in `t`.

Surfaces fill all space: intersect with a bounded solid before meshing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal, TypedDict, Unpack

import numpy as np

from frep import ArgumentError, ArgumentTypeError, Field, FieldLike, as_field, clip, constant, coordinates
from frep.arguments import direction, sizes, suggestion, turn

from . import waveforms
from .variants import SCALES, Depths, PeriodicSurface, fixed_box
from .variants import LoosePiecesWarning as LoosePiecesWarning
from .variants import SealedChannelWarning as SealedChannelWarning
from .waveforms import WAVEFORMS, Formula, Wave


class Natural(TypedDict, total=False):
    """The natural parameters of every surface, see the module."""

    phase: Sequence[FieldLike]
    rotation: Any
    scale: Literal["distance", "gradient", "range"]
    drop_x: FieldLike
    drop_y: FieldLike
    drop_z: FieldLike
    over: Any


# --- arguments -----------------------------------------------------------------------------------------------------------


def _drops(natural: dict[str, Any]) -> list[Field]:
    drops = []
    for name in ("drop_x", "drop_y", "drop_z"):
        drop = as_field(natural.pop(name, 1.0), name)
        if drop.is_constant and not -1.0 <= drop.data <= 1.0:
            raise ArgumentError(f"{name}: expected a number in [-1, 1], got {drop.data:g}")
        if not drop.is_constant:
            least, most = drop.bounds([-np.inf] * 3, [np.inf] * 3)
            if least > 1.0 or most < -1.0:
                raise ArgumentError(f"{name}: expected values in [-1, 1], got a Field from {least:g} to {most:g}")
            drop = clip(drop, -1.0, 1.0)
        drops.append(drop)
    return drops


def _phases(value: Any) -> list[Field]:
    if isinstance(value, (Field, str)) or not hasattr(value, "__len__") or len(value) != 3:
        raise ArgumentTypeError(f"phase: expected three angles in rad, numbers or Fields, got {value!r}")
    return [as_field(p, "phase") for p in value]


def _axes(rotation: Any) -> np.ndarray:
    """(3, 3): the axes of the cell, as columns."""
    if rotation is None:
        return np.eye(3)
    if isinstance(rotation, tuple) and len(rotation) == 2:
        u, angle = direction(rotation[0], "rotation"), turn(rotation[1], "rotation")
        k = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
        return np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * k @ k
    try:
        matrix = np.asarray(rotation, dtype=float)
    except (TypeError, ValueError):
        matrix = np.zeros(0)
    if matrix.shape != (3, 3):
        raise ArgumentTypeError(f"rotation: expected (axis, angle in rad) or a (3, 3) matrix, got {rotation!r}")
    if not (np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-9) and np.linalg.det(matrix) > 0.0):
        raise ArgumentError(f"rotation: expected a matrix that turns and does not stretch or mirror, got {rotation!r}")
    return matrix


def _placed(rotation: Any, phases: Sequence[Field], period: Sequence[float]) -> tuple[Field, Field, Field]:
    """The coordinates in the axes of the cell, in mm: turned back, and moved by the phase."""
    axes = _axes(rotation).copy()
    axes[np.abs(axes) < 1e-15] = 0.0
    place = []
    for i in range(3):
        along = sum((axes[j, i] * c for j, c in enumerate(coordinates())), start=constant(0.0))
        place.append(along + phases[i] * (period[i] / (2.0 * math.pi)))
    return place[0], place[1], place[2]


def _surface(
    formula: Callable[[Any], Formula],
    cell: Any,
    label: str,
    natural: Natural,
    *,
    periods: float = 1.0,
    mirrored: bool = False,
    congruent: bool = False,
    shares: Depths | None = None,
    unfolded: bool = False,
    knots: tuple[float, ...] = (),
    blend: Field | None = None,
) -> PeriodicSurface:
    """The surface of a formula: of `formula(0)`, or, where a Field `blend` varies it, of `formula(blend)`, with those of
    `knots` as samples. `periods`: cells in a period of the formula. `unfolded`: the third axis has no period."""
    given: dict[str, Any] = dict(natural)
    size = tuple(float(s) for s in sizes(cell, "cell"))
    scale = given.pop("scale", "distance")
    if scale not in SCALES:
        raise ArgumentError(f'scale: expected "distance", "gradient" or "range", got {scale!r}')
    drops, phases, rotation = _drops(given), _phases(given.pop("phase", (0.0, 0.0, 0.0))), given.pop("rotation", None)
    over = given.pop("over", None)
    box = None if over is None else fixed_box(over)
    if given:
        unknown, known = sorted(given), sorted(Natural.__annotations__)
        hint = suggestion(unknown[0], known)
        raise ArgumentTypeError(f"{label}: unknown parameters {unknown}; expected {', '.join(known)}{hint}")
    period = (size[0] * periods, size[1] * periods, size[2] * periods)
    place = _placed(rotation, phases, period)

    def waves(at: Sequence[Field], weights: Sequence[Field]) -> list[Wave]:
        return [
            Wave(c * (2.0 * math.pi / p), w.data if w.is_constant else w, mirrored)
            for c, p, w in zip(at, period, weights, strict=True)
        ]

    steady = all(d.is_constant for d in drops)
    # Samples of a waveform that a drop varies: of its formula.
    plain = [d if d.is_constant else constant(1.0) for d in drops]
    level = formula(blend if blend is not None else 0.0)(*waves(place, drops))
    axes, repeat = coordinates(), period
    if unfolded:
        place, axes, repeat = _folded(place, period)
    members = tuple(formula(knot)(*waves(axes, plain)) for knot in knots or (0.0,))
    if any(member.is_constant for member in members):
        raise ArgumentError(f"drop_x, drop_y, drop_z: nothing of {label} is left when it is flattened like this")
    untouched = all(d == constant(1.0) for d in drops)
    return PeriodicSurface(
        level,
        (size[0], size[1], size[2]),
        label,
        members,
        repeat,
        place,
        scale=scale,
        complement_congruent=congruent and untouched,
        knots=knots,
        blend=blend,
        steady=steady,
        shares=shares if untouched else None,
        aperiodic=unfolded,
        over=box,
    )


def _folded(
    place: tuple[Field, Field, Field], period: tuple[float, float, float]
) -> tuple[tuple[Field, Field, Field], tuple[Field, Field, Field], tuple[float, float, float]]:
    """Place, axes and period for a surface whose third axis has no period and whose ends are upright.

    A cell up and down from its middle it is mirrored, which gives it a period of four cells; beyond that cell its last
    value holds.
    """
    x, y, z = coordinates()
    reach = period[2]
    there_and_back = reach - abs((z + reach) % (4.0 * reach) - 2.0 * reach)
    return (
        (place[0], place[1], clip(place[2], -reach, reach)),
        (x, y, there_and_back),
        (period[0], period[1], 4.0 * reach),
    )


def _fixed(formula: Formula) -> Callable[[Any], Formula]:
    return lambda _: formula


def _entry(label: str, cell: Any, natural: Natural, periods: float = 1.0) -> PeriodicSurface:
    facts = WAVEFORMS[label]
    return _surface(
        _fixed(facts.formula),
        cell,
        label,
        natural,
        periods=periods,
        mirrored=facts.mirrored,
        congruent=facts.complement_congruent,
        shares=Depths(
            (facts.pinch[0] * periods, facts.pinch[1] * periods), (facts.full[0] * periods, facts.full[1] * periods)
        ),
    )


# --- the surfaces --------------------------------------------------------------------------------------------------------


def gyroid(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Schoen's gyroid, sin x cos y + sin y cos z + sin z cos x (LF-rep Table 3.5; von Schnering and Nesper 1991).

    Example:
        >>> gyroid(cell=5)
        <gyroid, cell 5 x 5 x 5 mm>
        >>> flat = gyroid(cell=5, drop_x=0)  # a prism: the same all along x
        >>> flat.level([[0, 1, 1], [3, 1, 1]]).round(6).tolist()
        [0.293893, 0.293893]
    """
    return _entry("gyroid", cell, natural)


def schwarz_p(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Schwarz's P, cos x + cos y + cos z (LF-rep Table 3.5; von Schnering and Nesper 1991)."""
    return _entry("schwarz_p", cell, natural)


def schwarz_d(cell: Any = 10.0, *, period: Literal["2pi", "pi"] = "2pi", **natural: Unpack[Natural]) -> PeriodicSurface:
    """Schwarz's D, the diamond: cos x cos y cos z - sin x sin y sin z (LF-rep Table 3.5; von Schnering and Nesper 1991).

    `period`: how much of the formula a cell holds. "2pi": a period, 32 skew hexagons, in which the sheet repeats twice along
    each axis. "pi": half of that, 4 hexagons, LatticeQuery's cell; a sheet has the period of that cell, `solid` and `inverse`
    change places from cell to cell.

    Raises:
        ArgumentError: another period.
    """
    if period not in ("2pi", "pi"):
        raise ArgumentError(f'period: expected "2pi" or "pi", got {period!r}')
    return _entry("schwarz_d", cell, natural, periods=1.0 if period == "2pi" else 2.0)


def neovius(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Neovius' surface, 3 (cos x + cos y + cos z) + 4 cos x cos y cos z (von Schnering and Nesper 1991; nTop)."""
    return _entry("neovius", cell, natural)


def iwp(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Schoen's I-WP, 2 (cos x cos y + cos y cos z + cos z cos x) - (cos 2x + cos 2y + cos 2z) (Schoen 1970; von Schnering and
    Nesper 1991)."""
    return _entry("iwp", cell, natural)


def f_rd(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Schoen's F-RD, 4 cos x cos y cos z - (cos 2x cos 2y + cos 2y cos 2z + cos 2z cos 2x) (Schoen 1970; von Schnering and
    Nesper 1991)."""
    return _entry("f_rd", cell, natural)


def lidinoid(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Lidin's surface, (sin 2x cos y sin z + cyclic) / 2 - (cos 2x cos 2y + cyclic) / 2 + 0.15 (Lidin and Larsson 1990;
    nTop and Fisher et al. 2023 for the form)."""
    return _entry("lidinoid", cell, natural)


def split_p(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Split P, 1.1 (sin 2x cos y sin z + cyclic) - 0.2 (cos 2x cos 2y + cyclic) - 0.4 (cos 2x + cos 2y + cos 2z) (nTop;
    Fisher et al. 2023)."""
    return _entry("split_p", cell, natural)


def fischer_koch_s(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Fischer and Koch's S, cos 2x sin y cos z + cos x cos 2y sin z + sin x cos y cos 2z (Fischer and Koch 1987; von
    Schnering and Nesper 1991)."""
    return _entry("fischer_koch_s", cell, natural)


def fischer_koch_cy(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Fischer and Koch's C(Y), (sin 2x sin y + cyclic) + (sin 2x cos z + cyclic) - sin x sin y sin z - cos x cos y cos z
    (Fischer and Koch 1989; von Schnering and Nesper 1991)."""
    return _entry("fischer_koch_cy", cell, natural)


def fischer_koch_cs(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Fischer and Koch's C(S), cos 2x + cos 2y + cos 2z + 2 (sin 3x sin 2y cos z + cyclic) + 2 (sin 2x cos 3y sin z + cyclic)
    (Fischer and Koch 1989; von Schnering and Nesper 1991)."""
    return _entry("fischer_koch_cs", cell, natural)


def octo(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Schoen's O,C-TO, 0.6 (cos x cos y + cyclic) - 0.4 (cos x + cos y + cos z) + 0.25 (Schoen 1970; Fisher et al. 2023)."""
    return _entry("octo", cell, natural)


def p_w_hybrid(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """P-W hybrid, 4 (cos x cos y + cyclic) - 3 cos x cos y cos z + 2.4 (K3DSurf and MathMod collections)."""
    return _entry("p_w_hybrid", cell, natural)


def gyroid_prime(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """G', sin 2x cos y sin z + sin 2y cos z sin x + sin 2z cos x sin y + 0.32 (von Schnering and Nesper 1991; Fisher et al.
    2023)."""
    return _entry("gyroid_prime", cell, natural)


def diamond_prime(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """D', (cos x cos y cos z + (cos x sin y sin z + cyclic)) / 2 - (sin 2x sin 2y + cyclic) / 2 - 0.2 (von Schnering and
    Nesper 1991; Fisher et al. 2023)."""
    return _entry("diamond_prime", cell, natural)


def double_gyroid(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Both skins of a thick gyroid, 2.75 (sin 2x cos y sin z + cyclic) - (cos 2x cos 2y + cyclic) (Wohlgemuth et al. 2001;
    Fisher et al. 2023)."""
    return _entry("double_gyroid", cell, natural)


def double_diamond(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Both skins of a thick diamond, (sin 2x sin 2y + cyclic) + cos 2x cos 2y cos 2z (Wohlgemuth et al. 2001; Fisher et al.
    2023)."""
    return _entry("double_diamond", cell, natural)


def double_primitive(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Both skins of a thick Schwarz P, (cos x cos y + cyclic) / 2 + (cos 2x + cos 2y + cos 2z) / 5 (Wohlgemuth et al. 2001;
    Fisher et al. 2023)."""
    return _entry("double_primitive", cell, natural)


def scherk(cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """Scherk's first surface, exp(z) cos y = cos x: minimal exactly, periodic in x and y; towards +z its walls are planes across
    y, towards -z planes across x (Scherk 1835).

    The third size of the cell is the height over which z grows by 2 pi. `drop_z` must be 1.
    """
    if as_field(natural.get("drop_z", 1.0), "drop_z") != constant(1.0):
        raise ArgumentError(
            f"drop_z: expected 1 for scherk, which is not a wave along z, got {natural.get('drop_z')!r}"
        )
    return _surface(_fixed(waveforms.scherk), cell, "scherk", natural, congruent=True, unfolded=True)


def surface(
    level: Callable[[Field, Field, Field], FieldLike], cell: Any = 10.0, **natural: Unpack[Natural]
) -> PeriodicSurface:
    """A surface of your own: where `level` of three angles in rad, of period 2 pi in each, is zero. Without drops.

    Raises:
        ArgumentTypeError: a level that cannot be called with three Fields.
        ArgumentError: a level of another period, one that is the same everywhere, or no number somewhere.

    Example:
        >>> import numpy as np
        >>> surface(lambda x, y, z: np.cos(x) + np.cos(y) + 0.5 * np.cos(z), cell=8)
        <surface, cell 8 x 8 x 8 mm>
    """
    if not callable(level):
        raise ArgumentTypeError(f"level: expected a function of three angles, got {level!r}")
    if any(name in natural for name in ("drop_x", "drop_y", "drop_z")):
        raise ArgumentError("drop_x, drop_y, drop_z: write them into the level")
    try:
        traced = as_field(level(*coordinates()), "level")
    except TypeError as error:
        raise ArgumentTypeError(
            f"level: expected a function of three angles, which can be called with Fields; {error}"
        ) from error
    if traced.is_constant:
        raise ArgumentError(
            f"level: expected a function that differs from place to place, got {traced.data:g} everywhere"
        )
    probe = np.random.default_rng(0).uniform(0.0, 2.0 * math.pi, (60, 3))
    values, turned = traced(probe), traced(probe + 2.0 * math.pi * np.eye(3)[np.arange(60) % 3])
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        place = ", ".join(f"{angle:.4g}" for angle in probe[bad[0]])
        raise ArgumentError(f"level: expected finite numbers, got {values[bad[0]]} at the angles ({place})")
    if not np.allclose(turned, values, atol=1e-6 * (1.0 + np.abs(values).max())):
        raise ArgumentError("level: expected a function of period 2 pi in each of its angles")
    return _surface(_fixed(lambda x, y, z: traced.substitute(x.angle, y.angle, z.angle)), cell, "surface", natural)


# --- transitions ---------------------------------------------------------------------------------------------------------


def primitive_gyroid_diamond(t: FieldLike, cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """From Schwarz P (`t` = 0) through the gyroid (1) to the diamond (2), by the factors of their terms (LatticeRobot).

    sin x, sin x cos y, and sin x cos y cos z lead the terms of the three; the cosines come in one after the other. The
    gyroid is that of `gyroid`; P is a quarter of a period along x, y and z from where `schwarz_p` has it, D three eighths. On
    the way their necks part and join, at t = 1/2 and 3/2, where the surface crosses itself and has no distance.

    Args:
        t: a number in [0, 2] or a Field, which is limited to it.

    Raises:
        ArgumentError: a number outside.

    Example:
        >>> import frep
        >>> x, y, z = frep.coordinates()
        >>> graded = primitive_gyroid_diamond(x / 20, cell=8).sheet(0.8)  # P at x = 0, the gyroid at 20, D at 40
    """

    def formula(at: Any) -> Formula:
        return waveforms.primitive_gyroid_diamond(_limited(at, 0.0, 1.0), _limited(at - 1.0, 0.0, 1.0))

    share = as_field(t, "t")
    if share.is_constant and not 0.0 <= share.data <= 2.0:
        raise ArgumentError(
            f"t: expected a number in [0, 2], 0 for Schwarz P, 1 for the gyroid, 2 for D; got {share.data:g}"
        )
    return _transition(formula, _limited(share, 0.0, 2.0), cell, "primitive_gyroid_diamond", natural, mirrored=True)


def primitive_neovius(t: FieldLike, cell: Any = 10.0, **natural: Unpack[Natural]) -> PeriodicSurface:
    """From Schwarz P (`t` = 0) to Neovius' surface (1) by the weight of the term that tells them apart, and beyond:
    3 (cos x + cos y + cos z) + 4 t cos x cos y cos z (LatticeRobot).

    At t = 3/4 necks close (and at -9/4), so that there the surface crosses itself and has no distance.

    Args:
        t: a number or a Field; a Field must have limits, at most 5 apart.

    Raises:
        ArgumentError: a Field without limits: limit it with `frep.clip`.
    """
    return _transition(
        waveforms.primitive_neovius, as_field(t, "t"), cell, "primitive_neovius", natural, mirrored=False
    )


def _limited(value: Any, least: float, most: float) -> Any:
    if isinstance(value, Field) and not value.is_constant:
        return clip(value, least, most)
    return min(max(float(value), least), most)


_KNOT = 0.2
"""Between the members of a transition that a Field drives: a surface blended of two is then within a thousandth of the cell of
that of the formula, a hundredth where necks part. No surface that crosses itself belongs to a multiple of it."""


def _transition(
    formula: Callable[[Any], Formula], t: Any, cell: Any, label: str, natural: Natural, *, mirrored: bool
) -> PeriodicSurface:
    share = as_field(t, "t")
    if share.is_constant:
        return _surface(_fixed(formula(share.data)), cell, label, natural, mirrored=mirrored, congruent=True)
    least, most = share.bounds([-np.inf] * 3, [np.inf] * 3)
    if not most - least <= 5.0:
        raise ArgumentError(f"t: expected a Field with limits at most 5 apart, which {share!r} has not; use frep.clip")
    first, last = math.floor(least / _KNOT + 1e-9), math.ceil(most / _KNOT - 1e-9)
    knots = tuple(_KNOT * k for k in range(first, max(last, first + 1) + 1))
    return _surface(formula, cell, label, natural, mirrored=mirrored, knots=knots, blend=share)


SURFACES: dict[str, Callable[..., PeriodicSurface]] = {
    make.__name__: make
    for make in (
        gyroid,
        schwarz_p,
        schwarz_d,
        neovius,
        iwp,
        f_rd,
        lidinoid,
        split_p,
        fischer_koch_s,
        fischer_koch_cy,
        fischer_koch_cs,
        octo,
        p_w_hybrid,
        gyroid_prime,
        diamond_prime,
        double_gyroid,
        double_diamond,
        double_primitive,
        scherk,
    )
}
"""Every surface of one formula, by name."""
