"""What RangeFinder knows of a lattice before the first query: which methods it allows, and the numbers that the kernels read.

A direction's *coordinates* are those in which its similarity is a shift by one; its *orbit* is the surface that all its steps
sweep. Both are rows of numbers, laid out by the constants of `frep/rangefinder_kernels.py`.

Source: Kurzeja, Constructive Lattice Geometry, 7.2 and 7.3.
"""

from __future__ import annotations

import itertools
import math
import weakref
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from . import rangefinder_kernels as kernels
from .errors import ArgumentTypeError
from .packing import Packer
from .similarity import Similarity
from .steady import SteadySkeleton

Method = Literal["auto", "O(1)", "O(u)", "O(uv)", "descent", "naive"]
Role = Literal["identity", "translation", "rotation", "dilation", "other"]

_SLOW = 1e-7  # a log scale or an angle a step below which a row is searched as if it had none, with wider beams
_STANDS = 1e-12  # of the lattice's size: a movement that rounding explains
_COMMUTES = 1e-11  # of the lattice's size: how far the ends of a lattice may differ when the order is exchanged

# --- which method --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Conditions:
    """What the three similarities of a lattice allow (thesis 7.3.1), tested on the operators themselves.

    Attributes:
        uv, uw, vw: whether the two commute over the whole lattice. A direction with one cluster commutes with any.
        u_extents, v_extents, w_extents: whether extents along a direction stay the same under the other two.
        v_by_w, w_by_v: the same for v and w alone.
        dual: three independent translations, at any angle: their dual basis serves where the extents change.
        dual_vw: the same for v and w.
    """

    uv: bool
    uw: bool
    vw: bool
    u_extents: bool
    v_extents: bool
    w_extents: bool
    v_by_w: bool
    w_by_v: bool
    dual: bool
    dual_vw: bool
    _one_sheet: bool = False

    @property
    def plain_constant(self) -> bool:
        """The five conditions of the thesis for O(1)."""
        return self.uv and self.uw and self.vw and self.u_extents and self.v_extents and self.w_extents

    @property
    def plain_linear(self) -> bool:
        """The three conditions of the thesis for O(u)."""
        return self.vw and self.v_by_w and self.w_by_v

    @property
    def methods(self) -> tuple[Method, ...]:
        """The methods that are exact here, the quickest first."""
        sheets = self.plain_linear or self.dual_vw
        constant = self.dual or (sheets and self._one_sheet)
        return (*(("O(1)",) if constant else ()), *(("O(u)",) if sheets else ()), "descent", "O(uv)", "naive")


def conditions(skeleton: SteadySkeleton) -> Conditions:
    """Which of the conditions for O(1) and O(u) hold; see `Conditions`.

    Raises:
        ArgumentTypeError: not a SteadySkeleton.

    Example:
        >>> from topologies.steady import Screw, SteadyLattice, Translation
        >>> racks = [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)]
        >>> u, v, w = Translation((1, 0, 0)), Screw(0.1), Translation((0, 0, 1))
        >>> conditions(SteadyLattice([(9, 0, 0)], 0.1, racks, u, v, w, (5, 63, 99)).skeleton).methods
        ('O(u)', 'descent', 'O(uv)', 'naive')
    """
    if not isinstance(skeleton, SteadySkeleton):
        raise ArgumentTypeError(f"skeleton: expected a SteadySkeleton, such as a lattice's .skeleton, got {skeleton!r}")
    cached = _conditions.get(skeleton)
    if cached is None:
        cached = _conditions[skeleton] = _tested(skeleton)
    return cached


_conditions: weakref.WeakKeyDictionary[SteadySkeleton, Conditions] = weakref.WeakKeyDictionary()


def _tested(skeleton: SteadySkeleton) -> Conditions:
    size, corners = _size(skeleton)
    active = _active(skeleton)
    roles = [
        _role(s, a, _farthest(skeleton, axis), size)
        for axis, (s, a) in enumerate(zip(skeleton.directions, active, strict=True))
    ]
    generators = [s.generator if a else np.zeros((4, 4)) for s, a in zip(skeleton.directions, active, strict=True)]

    def commute(a: int, b: int) -> bool:
        # Exchanging all steps of a and b moves the lattice by at most its two numbers of steps times the bracket.
        bracket = generators[a] @ generators[b] - generators[b] @ generators[a]
        most = float(np.abs(corners @ bracket[:3, :3].T + bracket[:3, 3]).max())
        return most * _farthest(skeleton, a) * _farthest(skeleton, b) <= _COMMUTES * size

    def fixes(a: int, b: int) -> bool:
        """Whether extents along `a` are unchanged by `b`."""
        pair = (roles[a], roles[b])
        if "identity" in pair:
            return True
        if pair == ("translation", "translation"):
            va, vb = skeleton.directions[a].velocity, skeleton.directions[b].velocity
            return abs(float(va @ vb)) * _farthest(skeleton, b) <= 1e-10 * float(va @ va)
        turning = "rotation" in pair and ("translation" in pair or "dilation" in pair)
        return turning and commute(a, b)

    every = [s.velocity for s, a in zip(skeleton.directions, active, strict=True) if a]
    shifts = all(r == "translation" or not a for r, a in zip(roles, active, strict=True))
    two = roles[1] == roles[2] == "translation"
    return Conditions(
        uv=commute(0, 1),
        uw=commute(0, 2),
        vw=commute(1, 2),
        u_extents=fixes(0, 1) and fixes(0, 2),
        v_extents=fixes(1, 0) and fixes(1, 2),
        w_extents=fixes(2, 0) and fixes(2, 1),
        v_by_w=fixes(1, 2),
        w_by_v=fixes(2, 1),
        dual=shifts and _independent(every),
        dual_vw=two and _independent([s.velocity for s in skeleton.directions[1:]]),
        _one_sheet=int(skeleton.counts[0]) == 1,
    )


def _independent(vectors: list[np.ndarray]) -> bool:
    if not vectors:
        return True
    units = np.array([v / np.linalg.norm(v) for v in vectors])
    return bool(np.linalg.svd(units, compute_uv=False).min() > 1e-6)


def _active(skeleton: SteadySkeleton) -> list[bool]:
    """Directions in which anything is moved: one cluster of index 0 stays where it is."""
    return [bool(n > 1 or s != 0) for n, s in zip(skeleton.counts, skeleton.start, strict=True)]


def _farthest(skeleton: SteadySkeleton, axis: int) -> int:
    first = int(skeleton.start[axis])
    return max(abs(first), abs(first + int(skeleton.counts[axis]) - 1))


def _role(similarity: Similarity, active: bool, steps: int, size: float) -> Role:
    if not active or similarity.kind == "identity":
        return "identity"
    if similarity.kind == "translation":
        return "translation"
    if similarity.kind == "swirl":
        return "dilation" if similarity.angle == 0.0 and abs(similarity.log_scale) >= _SLOW else "other"
    pitch = float(similarity.axis @ similarity.velocity)
    turn = math.remainder(similarity.angle, math.tau)
    return "rotation" if abs(pitch) * steps <= _STANDS * size and abs(turn) >= _SLOW else "other"


def _size(skeleton: SteadySkeleton) -> tuple[float, np.ndarray]:
    """How large coordinates get, and the corners, edges' and faces' middles of the brick, (27 n, 3)."""
    ends = [
        sorted({int(s), int(s + (n - 1) // 2), int(s + n - 1)})
        for s, n in zip(skeleton.start, skeleton.counts, strict=True)
    ]
    index = np.array(list(itertools.product(*ends)))
    centers, radii = skeleton.balls(*index.T)
    points = centers.reshape(-1, 3)
    size = float(np.abs(points).max() + radii.max())
    for s in skeleton.directions:
        point = _center(s)
        size += float(np.abs(point).max()) if point is not None else 0.0
    return size, points


# --- coordinates of a row ------------------------------------------------------------------------------------------------


def _center(s: Similarity) -> np.ndarray | None:
    """The point that coordinates are about: fixed, or on the axis; None for what is searched as a translation."""
    if abs(s.log_scale) >= _SLOW:
        return s.fixed_point
    return s.point if abs(s.angle) >= _SLOW else None


def _basis(axis: np.ndarray) -> np.ndarray:
    """(3, 3) rows: two unit vectors across the axis, and the axis; right-handed."""
    other = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = np.cross(axis, other)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(axis, first), axis])


def coordinates_of(s: Similarity, first: int, last: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """What the kernels need to bound steps `first` to `last` of S: coordinates (COORDINATES,) and orbit (ORBIT,).

    Between exact kinds, near scale 1 and near angle 0, S is searched as the simpler kind; `slack` widens each beam by more than
    the two can differ over these steps: |e^(tA) - 1| (|x| + |t v|) with t up to the last step.
    """
    c, o = np.zeros(kernels.COORDINATES), np.zeros(kernels.ORBIT)
    steps = max(abs(first), abs(last))
    turn = math.remainder(s.angle, math.tau)
    center = _center(s)
    axis, pitch, slack = s.axis, 0.0, 0.0
    if abs(s.log_scale) >= _SLOW:
        c[kernels.C_LINEAR], c[kernels.C_VECTOR : kernels.C_VECTOR + 3] = kernels.SHELL, center
        c[kernels.C_STEP] = s.log_scale
        scales = sorted(math.exp(s.log_scale * k) for k in (first, last))
        o[kernels.O_CLASS], o[kernels.O_RANGE : kernels.O_RANGE + 2] = kernels.CONE, scales
        speed = 0.0
    elif center is not None:
        pitch = speed = float(axis @ s.velocity)
        slack = math.expm1(abs(s.log_scale) * steps)
        if abs(turn) < _SLOW:
            slack += abs(turn) * steps
        o[kernels.O_CLASS], o[kernels.O_RANGE : kernels.O_RANGE + 2] = (
            kernels.HELIX,
            sorted((pitch * first, pitch * last)),
        )
    else:
        center = np.zeros(3)
        pitch = speed = float(np.linalg.norm(s.velocity))
        slack = math.expm1((abs(s.log_scale) + abs(s.angle)) * steps)
        axis = s.velocity / pitch if pitch > 1e-290 else axis
        o[kernels.O_CLASS] = kernels.LINE
    spread = slack * steps * abs(speed)
    if o[kernels.O_CLASS] != kernels.CONE:
        if abs(pitch) * steps > _STANDS * size and pitch * pitch > 0.0:
            c[kernels.C_LINEAR], c[kernels.C_VECTOR : kernels.C_VECTOR + 3] = kernels.HEIGHT, axis / pitch
            c[kernels.C_NORM] = 1.0 / abs(pitch)
        elif o[kernels.O_CLASS] == kernels.LINE:
            o[kernels.O_CLASS] = kernels.STILL
            spread += abs(pitch) * steps
    frame = _basis(axis)
    c[kernels.C_TURN] = turn if abs(turn) >= _SLOW and o[kernels.O_CLASS] in (kernels.HELIX, kernels.CONE) else 0.0
    for a, point, rows in ((c, kernels.C_POINT, kernels.C_FRAME), (o, kernels.O_POINT, kernels.O_FRAME)):
        a[point : point + 3], a[rows : rows + 9] = center, frame.ravel()
    c[kernels.C_SLACK : kernels.C_SLACK + 2] = o[kernels.O_SLACK : kernels.O_SLACK + 2] = spread, slack
    return c, o


# --- packing -------------------------------------------------------------------------------------------------------------

_packed: weakref.WeakKeyDictionary[SteadySkeleton, dict[tuple[str, int], kernels.Lattice]] = weakref.WeakKeyDictionary()


def packed(skeleton: SteadySkeleton, what: str, method: int) -> kernels.Lattice:
    held = _packed.setdefault(skeleton, {})
    if (what, method) not in held:
        held[what, method] = _pack(skeleton, what, method)
    return held[what, method]


def _racks(skeleton: SteadySkeleton, what: str) -> np.ndarray:
    """The racks that are searched: beams; nodes, as beams of no length; or beams and the nodes that may have none."""
    if what == "beams":
        return np.array(skeleton.racks, np.int64, order="C")
    nodes = np.arange(len(skeleton.nodes)) if what == "nodes" else skeleton.lone_nodes
    balls = np.zeros((len(nodes), 5), np.int64)
    balls[:, 0] = balls[:, 1] = nodes
    return balls if what == "nodes" else np.vstack([skeleton.racks, balls]).astype(np.int64)


def _group(s: Similarity) -> np.ndarray:
    frame = _basis(s.axis)
    tiny = (
        math.hypot(s.log_scale, s.angle) < 1e-140
    )  # its square underflows; nothing turns or grows in any number of steps
    return np.array([0.0 if tiny else s.log_scale, 0.0 if tiny else s.angle, *frame.ravel(), *(frame @ s.velocity)])


def _table(s: Similarity, ts: Any) -> np.ndarray:
    """(n, 13): the matrices of S^t row by row, and their scales."""
    t = np.asarray(ts, float)
    return np.hstack([s.powers(t)[:, :3].reshape(-1, 12), np.exp(s.log_scale * t)[:, None]])


def _images(table: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (..., 3) under rows (..., 13) of a table, broadcast."""
    m = table[..., :12].reshape(*table.shape[:-1], 3, 4)
    return np.einsum("...ab,...b->...a", m[..., :3], points) + m[..., 3]


def _pack(skeleton: SteadySkeleton, what: str, method: int) -> kernels.Lattice:
    racks = _racks(skeleton, what)
    u, v, w = skeleton.directions
    start, count = skeleton.start.astype(np.int64), skeleton.counts.astype(np.int64)
    size, _ = _size(skeleton)
    none = np.zeros((0, 13))
    nodes, radii = np.asarray(skeleton.nodes, float), np.asarray(skeleton.radii, float)
    balls, hubs, sheet_hubs = np.zeros((0, 1, 4)), np.zeros((0, 4)), np.zeros((0, 4))
    v_powers = v_local = steps = sheet_steps = none
    orbits = [np.zeros(kernels.ORBIT)] * 2
    coordinates = np.zeros((2, kernels.COORDINATES))
    fdata, idata, tree = np.zeros(1), np.zeros(1, np.int32), np.zeros(3, np.int64)
    dual, templates = np.zeros((3, 4)), np.zeros((0, kernels.BEAM + 6))
    translations = np.array(
        [s.velocity if a else np.zeros(3) for s, a in zip((u, v, w), _active(skeleton), strict=True)]
    )
    if method in (kernels.NAIVE, kernels.ROWS, kernels.SHEETS):
        u_powers = _table(u, start[0] + np.arange(count[0]))
        centers = _images(u_powers[:, None], nodes[None])
        balls = np.concatenate([centers, (u_powers[:, 12:] * radii)[..., None]], axis=2)
        steps = _table(w, np.append(racks[:, 4], 1))
        sheet_steps = np.hstack(
            [_chained(w, racks[:, 4], v, racks[:, 3]), steps[:-1, 12:] * np.exp(v.log_scale * racks[:, 3:4])]
        )
    if method in (kernels.NAIVE, kernels.ROWS):
        v_powers = _table(v, start[1] + np.arange(count[1]))
        coordinates[1], orbits[0] = coordinates_of(w, int(start[2]), int(start[2] + count[2] - 1), size)
        orbits[0][kernels.O_SWAY], orbits[0][kernels.O_CLIMB] = _sway(w, racks, orbits[0])
        v_local = _in_frame(v_powers, orbits[0])
        hubs = _hubs(skeleton, racks, balls, v, w)
    elif method == kernels.SHEETS:
        coordinates, orbits[1] = _sheet(skeleton, size)
        sheet_hubs = _sheet_hubs(racks, balls, sheet_steps)
    elif method == kernels.BOXES:
        dual, templates = _boxes(racks, nodes, radii, translations)
    else:
        fdata, idata, tree = _tree(skeleton, racks)
    return kernels.Lattice(
        racks=racks, start=start, span=count, balls=balls, hubs=hubs, sheet_hubs=sheet_hubs, v_powers=v_powers, v_local=v_local,
        steps=steps, sheet_steps=sheet_steps, orbit=orbits[0], sheet_orbit=orbits[1], coordinates=coordinates,
        groups=np.array([_group(v), _group(w)]), dual=dual, translations=translations, templates=templates, size=size,
        fdata=fdata, idata=idata, tree=tree,
    )  # fmt: skip


def _chained(w: Similarity, dk: np.ndarray, v: Similarity, dj: np.ndarray) -> np.ndarray:
    """(m, 12): W^dk V^dj row by row."""
    return (w.powers(dk.astype(float)) @ v.powers(dj.astype(float)))[:, :3].reshape(-1, 12)


def _in_frame(table: np.ndarray, orbit: np.ndarray) -> np.ndarray:
    frame = orbit[kernels.O_FRAME : kernels.O_FRAME + 9].reshape(3, 3)
    m = table[:, :12].reshape(-1, 3, 4).copy()
    m[:, :, 3] -= orbit[kernels.O_POINT : kernels.O_POINT + 3]
    return np.hstack([(frame @ m).reshape(-1, 12), table[:, 12:]])


def _sway(w: Similarity, racks: np.ndarray, orbit: np.ndarray) -> tuple[float, float]:
    """How far W^dk of a rack moves a point across its orbit: so much of its distance from the centre, and so many mm."""
    if orbit[kernels.O_CLASS] not in (kernels.HELIX, kernels.CONE):
        return 0.0, 0.0
    most = max((abs(np.expm1(complex(w.log_scale, w.angle) * int(dk))) for dk in racks[:, 4]), default=0.0)
    climb = float(orbit[kernels.O_CLASS] == kernels.HELIX) * abs(float(w.axis @ w.velocity))
    return float(most), climb * float(np.abs(racks[:, 4]).max(initial=0))


def _middle(balls: np.ndarray) -> np.ndarray:
    """(nu, 3) centres of the clusters."""
    return 0.5 * (balls[..., :3].min(axis=1) + balls[..., :3].max(axis=1))


def _hubs(skeleton: SteadySkeleton, racks: np.ndarray, balls: np.ndarray, v: Similarity, w: Similarity) -> np.ndarray:
    """(nu, 4) for each i: a centre h, and how far from it, with W^dk left out, the beams of cluster (i, 0, 0) reach."""
    h = _middle(balls)
    reach = (np.linalg.norm(balls[..., :3] - h[:, None], axis=2) + balls[..., 3]).max(axis=1)
    for _, end, di, dj, dk in racks:
        i = np.arange(len(h))
        i = i[(i + di >= 0) & (i + di < len(h))]
        far = balls[i + di, end]
        scale = math.exp(v.log_scale * dj)
        there = _images(_table(v, [dj]), far[:, :3])
        radius = far[:, 3] * scale * max(1.0, math.exp(w.log_scale * dk))
        reach[i] = np.maximum(reach[i], np.linalg.norm(there - h[i], axis=1) + radius)
    return np.hstack([h, reach[:, None]])


def _sheet_hubs(racks: np.ndarray, balls: np.ndarray, sheet_steps: np.ndarray) -> np.ndarray:
    """(nu, 4) for each i: a ball that holds the beams of cluster (i, 0, 0)."""
    h = _middle(balls)
    reach = (np.linalg.norm(balls[..., :3] - h[:, None], axis=2) + balls[..., 3]).max(axis=1)
    for (_, end, di, _, _), step in zip(racks, sheet_steps, strict=True):
        i = np.arange(len(h))
        i = i[(i + di >= 0) & (i + di < len(h))]
        far = balls[i + di, end]
        reach[i] = np.maximum(reach[i], np.linalg.norm(_images(step, far[:, :3]) - h[i], axis=1) + far[:, 3] * step[12])
    return np.hstack([h, reach[:, None]])


def _sheet(skeleton: SteadySkeleton, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (2, COORDINATES) of V and W that each other leaves alone, and the surface that both together sweep."""
    found, orbits, roles = [], [], []
    for axis in (1, 2):
        s, first = skeleton.directions[axis], int(skeleton.start[axis])
        active = _active(skeleton)[axis]
        roles.append(_role(s, active, _farthest(skeleton, axis), size))
        c, o = coordinates_of(
            s if active else Similarity.identity(), first, first + int(skeleton.counts[axis]) - 1, size
        )
        found.append(c)
        orbits.append(o)
    if "identity" in roles:
        return np.array(found), orbits[1] if roles[0] == "identity" else orbits[0]
    if "rotation" not in roles:
        pair = np.array([skeleton.v.velocity, skeleton.w.velocity])
        for c, d in zip(found, np.linalg.pinv(pair).T, strict=True):
            c[kernels.C_VECTOR : kernels.C_VECTOR + 3], c[kernels.C_NORM] = d, np.linalg.norm(d)
        normal = np.cross(*pair)
        orbit = np.zeros(kernels.ORBIT)
        orbit[kernels.O_CLASS] = kernels.PLANE
        orbit[kernels.O_FRAME : kernels.O_FRAME + 9] = _basis(normal / np.linalg.norm(normal)).ravel()
        return np.array(found), orbit
    orbit = orbits[roles.index("rotation")].copy()
    if "dilation" in roles:
        fixed = orbits[roles.index("dilation")]
        orbit[kernels.O_CLASS], orbit[kernels.O_RANGE : kernels.O_RANGE + 2] = kernels.CONE, (0.0, math.inf)
        orbit[kernels.O_POINT : kernels.O_POINT + 3] = fixed[kernels.O_POINT : kernels.O_POINT + 3]
    else:
        orbit[kernels.O_RANGE : kernels.O_RANGE + 2] = -math.inf, math.inf
    return np.array(found), orbit


def _boxes(
    racks: np.ndarray, nodes: np.ndarray, radii: np.ndarray, translations: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The dual basis (3, 4) with lengths, and each rack's prepared beam with its extents along it."""
    moving = np.flatnonzero(np.any(translations != 0.0, axis=1))
    dual = np.zeros((3, 4))
    if len(moving):
        dual[moving, :3] = np.linalg.pinv(translations[moving]).T
        dual[:, 3] = np.linalg.norm(dual[:, :3], axis=1)
    templates = np.zeros((len(racks), kernels.BEAM + 6))
    for (first, last, *offset), row in zip(racks, templates, strict=True):
        ends = np.array([nodes[first], nodes[last] + np.array(offset) @ translations])
        widths = radii[[first, last]]
        kernels.prepare(*ends[0], widths[0], *ends[1], widths[1], row)
        heights, spread = ends @ dual[:, :3].T, np.outer(widths, dual[:, 3])
        row[kernels.BEAM :] = *(heights - spread).min(axis=0), *(heights + spread).max(axis=0)
    return dual, templates


def _tree(skeleton: SteadySkeleton, racks: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The lattice as `frep/steady_kernels.py` reads it."""
    packer = Packer()
    rows = np.zeros((len(racks), kernels.SEGMENT))
    rows[:, 0:3], rows[:, 3:6] = skeleton.nodes[racks[:, 0]], skeleton.nodes[racks[:, 1]]
    rows[:, 6:8] = skeleton.radii[racks[:, :2]]
    segments = packer.floats(rows)
    data, index, *_ = skeleton._packed(packer, rows, np.ascontiguousarray(racks[:, 2:]))
    where = np.array([data, index, segments], np.int64)
    return packer.joined("f", np.float64), packer.joined("i", np.int32), where
