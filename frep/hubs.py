"""Exact integrals of beams and hubs.

A *hub* is a node ball with its half-beams: cones tangent to the balls at both ends, cut half-way between the two contact
circles. That plane always meets the cone (the plane equidistant from the nodes need not), both ends of a beam agree on it,
and it leaves the union of the hubs as it is. A lattice is *clean* when its hubs do not overlap; then its volume, area and
moments are the sums over its hubs (steady-and-clg 2.1.1, 3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from .arguments import positive
from .errors import ArgumentError, ArgumentTypeError


@dataclass(frozen=True, eq=False)
class HubMoments:
    """What `hub_moments` finds, about the node as origin.

    Attributes:
        volume: mm3.
        area: of the lateral surface, mm2: cones and ball, without the disks where half-beams are cut.
        moment: (4, 4), the integral of [x; 1] [x; 1]^T over the volume: second moments (mm5), first moments (mm4), volume.
        excess: how far in mm along a ruling a seam between two half-beams passes the cut of one of them. Where it is
            above 0 the hub is not clean and the other figures do not hold.
        beam: which half-beam that is; -1 for a hub without beams.
        other: the half-beam that it meets there; -1 for a lone half-beam.
    """

    volume: float
    area: float
    moment: np.ndarray
    excess: float
    beam: int
    other: int


def cone_beam(length: float, r1: float, r2: float) -> tuple[float, float]:
    """Volume and surface area of a beam: the convex hull of two balls (steady-and-clg 2.1).

    Args:
        length: between the centres, in mm, at least 0.
        r1: radius of one ball, in mm.
        r2: radius of the other.

    Returns:
        Volume in mm3 and area in mm2. Where one ball holds the other the beam is the larger ball.

    Raises:
        ArgumentError: `length` is negative, a radius is not positive, or one of them is not finite.

    >>> volume, area = cone_beam(2, 0.5, 0.25)
    >>> round(volume, 10), round(area, 10)
    (1.2251393226, 6.7495154667)
    """
    if isinstance(length, bool) or length != 0:
        length = positive(length, "length")
    r1, r2 = positive(r1, "r1"), positive(r2, "r2")
    if length <= abs(r1 - r2):
        r = max(r1, r2)
        return 4.0 / 3.0 * math.pi * r**3, 4.0 * math.pi * r**2
    s = (r1 - r2) / length
    c = math.sqrt((1.0 - s) * (1.0 + s))
    p1, p2 = r1 * c, r2 * c
    volume = math.pi * length * c * c * (p1 * p1 + p1 * p2 + p2 * p2) / 3.0 + _cap(r1, s) + _cap(r2, -s)
    area = math.pi * (p1 + p2) * length * c + 2.0 * math.pi * (r1 * r1 * (1.0 + s) + r2 * r2 * (1.0 - s))
    return volume, area


def _cap(radius: float, s: float) -> float:
    """Volume of the part of a ball up to the plane `x = s radius`."""
    height = radius * (1.0 + s)
    return math.pi * height * height * (3.0 * radius - height) / 3.0


def hub_moments(radius: float, ends: Any, end_radii: Any) -> HubMoments:
    """Volume, area, first and second moments of a hub, to rounding.

    Lateral faces are integrated along their rulings in closed form and around their axis piece by piece between the seams;
    what lies inside follows from the divergence theorem, because the tangent planes of all faces are at one distance from
    the node.

    Args:
        radius: of the node ball, in mm. The node is the origin.
        ends: (m, 3) centres of the balls at the other ends of its beams, in mm; m may be 0.
        end_radii: (m,) their radii, in mm.

    Raises:
        ArgumentError: wrong shapes, numbers that are not finite or not positive, or a ball that holds the one at the other
            end of its beam (there is no half-beam then).

    >>> ends = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    >>> hub = hub_moments(0.2, ends, [0.2] * 6)
    >>> round(hub.volume, 7), round(hub.area, 7), hub.excess < 0
    (0.2864815, 2.4122662, True)
    """
    radius = positive(radius, "radius")
    centres = (
        _numbers(ends, "ends", "(m, 3)").reshape(-1, 3) if np.size(ends) == 0 else _numbers(ends, "ends", "(m, 3)")
    )
    radii = _numbers(end_radii, "end_radii", "(m,)").reshape(-1)
    if centres.ndim != 2 or centres.shape[1] != 3:
        raise ArgumentError(f"ends: expected points of shape (m, 3) in mm, got shape {centres.shape}")
    if radii.shape != (len(centres),):
        raise ArgumentError(f"end_radii: expected {len(centres)} radii, one for each of `ends`, got {len(radii)}")
    if not np.all(radii > 0.0):
        raise ArgumentError(f"end_radii: expected radii > 0 mm, got {float(radii.min())!r}")
    lengths = np.linalg.norm(centres, axis=1)
    held = np.flatnonzero(lengths <= np.abs(radius - radii))
    if len(held):
        i = int(held[0])
        raise ArgumentError(
            f"ends: the node of radius {radius:g} mm at the origin and node {i} of radius {radii[i]:g} mm are"
            f" {lengths[i]:g} mm apart: one ball holds the other, and there is no beam between them"
        )
    row = hub_rows(np.array([radius]), np.array([0, len(centres)]), centres, radii)[0]
    return HubMoments(
        volume=float(row[4]),
        area=float(row[0]),
        moment=moment_matrices(row[None, 4:])[0],
        excess=float(row[1]),
        beam=int(row[2]),
        other=int(row[3]),
    )


def _numbers(value: Any, name: str, shape: str) -> np.ndarray:
    try:
        numbers = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{name}: expected numbers in mm of shape {shape}, got {value!r}") from None
    if not np.all(np.isfinite(numbers)):
        raise ArgumentError(f"{name}: expected finite numbers in mm, got {value!r}")
    return numbers


def hub_rows(radii: np.ndarray, first: np.ndarray, ends: np.ndarray, end_radii: np.ndarray) -> np.ndarray:
    """Many hubs at once, in parallel: one row each, with the columns of `hub_kernels` (area, excess, beam, other, moments).

    Args:
        radii: (n,) radii of the nodes.
        first: (n + 1,) the half-beams of hub i are rows first[i] to first[i + 1] of the next two.
        ends: (m, 3) centres of their other balls, relative to the node.
        end_radii: (m,) radii of those.

    A hub in which one ball holds another becomes a row of NaN. Nothing else is checked.
    """
    from .hub_kernels import HUB_ROW, hubs

    rows = np.empty((len(radii), HUB_ROW))
    hubs(
        np.ascontiguousarray(radii, dtype=np.float64),
        np.ascontiguousarray(first, dtype=np.int64),
        np.ascontiguousarray(ends, dtype=np.float64),
        np.ascontiguousarray(end_radii, dtype=np.float64),
        rows,
    )
    return rows


_ROW_OF = np.array([[4, 5, 6, 1], [5, 7, 8, 2], [6, 8, 9, 3], [1, 2, 3, 0]])
"""Where the ten moments of a row stand in the symmetric 4x4 matrix."""


def moment_matrices(moments: np.ndarray) -> np.ndarray:
    """(n, 10) moments 1, x, y, z, xx, xy, xz, yy, yz, zz as (n, 4, 4) integrals of [x; 1] [x; 1]^T."""
    return moments[:, _ROW_OF]
