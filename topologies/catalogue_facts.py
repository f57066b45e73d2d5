"""What a topology turns out to be: when its channels close, when it is full, its point group; from samples.

Samples take seconds: what they tell is written down in `catalogue_table.py`, by `python -m topologies.catalogue_written`
after a change of a topology. Tests hold it to the samples.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from frep import Field
from frep.catalogue import Facts

from .beams import BeamTopology
from .foams import Foam
from .noise import Spinodal
from .variants import PeriodicSurface, _extremes, _pinch

_NODES = 48
"""Samples along the shortest side of a period: 1/2, 1/3, 1/4, 1/8, 1/12 and so on of it fall on them."""

_GRAIN = 24
"""Samples along each side by which symmetries are looked for: all screws and glides of cubic groups fall on them."""

_CLASSES = {
    # order; whether there is an inversion, nothing but turns, turns of 120, of 90 degrees, of 90 with an inversion
    (48, True, False, True, True, True): "m-3m",
    (24, False, True, True, True, False): "432",
    (24, False, False, True, False, True): "-43m",
    (24, True, False, True, False, False): "m-3",
    (16, True, False, False, True, True): "4/mmm",
    (12, False, True, True, False, False): "23",
    (12, True, False, True, False, False): "-3m",
    (8, True, False, False, False, False): "mmm",
    (8, False, False, False, True, False): "4mm",
    (8, False, True, False, True, False): "422",
    (8, False, False, False, False, True): "-42m",
    (8, True, False, False, True, True): "4/m",
    (6, False, False, True, False, False): "3m",
    (6, False, True, True, False, False): "32",
    (6, True, False, True, False, False): "-3",
    (4, False, True, False, True, False): "4",
    (4, False, False, False, False, True): "-4",
    (4, False, True, False, False, False): "222",
    (4, False, False, False, False, False): "mm2",
    (4, True, False, False, False, False): "2/m",
    (3, False, True, True, False, False): "3",
    (2, False, True, False, False, False): "2",
    (2, False, False, False, False, False): "m",
    (2, True, False, False, False, False): "-1",
    (1, False, True, False, False, False): "1",
}
"""The crystal classes that the axes of a cube can show; those with sixfold axes cannot."""


def samples(field: Field, period: Any, count: int = _NODES) -> np.ndarray:
    """Values of a periodic Field at the nodes of one period, `count` along its shortest side."""
    size = np.asarray(period, float)
    counts = [2 * round(0.5 * count * p / size.min()) for p in size]
    axes = [np.arange(n) * p / n for n, p in zip(counts, size, strict=True)]
    return field(np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)).reshape(counts)


def symmetries(field: Field, period: Any) -> tuple[str, bool]:
    """The point group of a periodic Field, and whether minus the Field is the Field moved, turned or mirrored.

    Each of the 48 turns and mirrors of a cube that keep the period is tried with all shifts at once: the greatest
    correlation is 1 where the Field comes upon itself, the least -1 where it comes upon its negative.

    Example:
        >>> from topologies import tpms
        >>> symmetries(tpms.gyroid(cell=1).level, (1, 1, 1))
        ('432', True)
    """
    size = np.asarray(period, float)
    axes = [np.arange(_GRAIN) * p / _GRAIN for p in size]
    values = field(np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)).reshape((_GRAIN,) * 3)
    values = values - values.mean()
    spectrum, power = np.fft.rfftn(values), float((values**2).sum())
    kept, swapped = [], False
    for order in itertools.permutations(range(3)):
        if not np.allclose(size[list(order)], size):
            continue
        for signs in itertools.product((1, -1), repeat=3):
            turned = values.transpose(order)
            for axis, sign in enumerate(signs):
                # Node i goes to node -i.
                turned = np.roll(np.flip(turned, axis), 1, axis) if sign < 0 else turned
            found = np.fft.irfftn(spectrum * np.conj(np.fft.rfftn(turned)), s=values.shape, axes=(0, 1, 2)) / power
            if found.max() > 1.0 - 1e-6:
                kept.append(np.eye(3)[list(order)] * np.array(signs)[:, None])
            swapped |= bool(found.min() < -1.0 + 1e-6)
    return _class_of(kept), swapped


def _class_of(turns: list[np.ndarray]) -> str:
    kinds = [(round(np.linalg.det(t)), round(np.trace(t))) for t in turns]
    return _CLASSES[
        len(turns),
        (-1, -3) in kinds,
        all(det > 0 for det, _ in kinds),
        (1, 0) in kinds,
        (1, 1) in kinds,
        (-1, -1) in kinds,
    ]


def of_beams(topology: BeamTopology, count: int = _NODES) -> Facts:
    """Facts of a periodic cell of beams: diameters of which pores close and the cell is full, of the shortest side."""
    period = topology.skeleton.size  # type: ignore[attr-defined]
    distance = topology.thicken(1.0).field + 0.5
    side = float(min(period))
    full = 2.0 * _extremes(distance, tuple(map(float, period)))[1] / side
    pinch = 2.0 * _pinch(samples(distance, period, count)) / side
    return Facts(pinch=pinch, full=full, symmetry=symmetries(distance, period)[0])


def of_hexagonal_beams(topology: BeamTopology) -> Facts:
    """As `of_beams` for a plane net of hexagons or triangles, whose sixfold axis the axes of a cube cannot show."""
    facts = of_beams(topology)
    return Facts(facts.pinch, facts.full, symmetry="6/mmm")


def of_surface(surface: PeriodicSurface) -> Facts:
    """Facts of a periodic surface; thicknesses of the cell's shortest side, biases in mm."""
    depths = surface.depths
    known: dict[str, Any] = {"range": surface.range, "symmetry": symmetries(surface.members[0], surface.period)[0]}
    if depths is None:
        return Facts(**known)
    # Depths without a table are sure to fill the cell, by up to half a sample's diagonal more than it takes.
    low, high = (-depths.full[0], depths.full[1]) if surface.shares else _extremes(surface.value, surface.period)
    return Facts(pinch=surface.pinch, full=2.0 * max(-low, high) / min(surface.cell), bias=(low, high), **known)


def of_scherk(surface: PeriodicSurface) -> Facts:
    """As `of_surface`; by its formula cos x and cos y change places, with a change of sign, where z does."""
    facts = of_surface(surface)
    return Facts(facts.pinch, facts.full, facts.bias, (-1.0, 1.0), "-42m")


def of_foam(foam: Foam) -> Facts:
    """Facts of a foam of cells 10 mm wide: closed from the start, but for the honeycomb, which is open along z."""
    full = 0.2 * foam.depth
    if foam.label == "honeycomb":
        return Facts(pinch=full, full=full, range=(0.0, foam.depth), symmetry="6/mmm")
    return Facts(pinch=0.0, full=full, range=(0.0, foam.depth), symmetry="m-3m")


def of_random_beams(topology: BeamTopology, cell: float) -> Facts:
    """Facts of a random periodic network whose cells are `cell` mm on average; its waveform is a distance."""
    facts = of_beams(topology, 2 * _NODES)  # several cells wide
    side = float(min(topology.skeleton.size)) / cell  # type: ignore[attr-defined]
    assert facts.pinch is not None
    assert facts.full is not None
    return Facts(pinch=facts.pinch * side, full=facts.full * side, symmetry="1")


def of_spinodal(structure: Spinodal) -> Facts:
    """Facts of a spinodal structure: biases that leave a thousandth, and the sheet that fills a cell."""
    low, high = (float(structure.bias_of(share).data) for share in (0.001, 0.999))
    reach = structure.distance()(samples_of(structure.period))
    return Facts(
        full=2.0 * float(np.abs(reach).max()) / min(structure.cell),
        bias=(low, high),
        range=_extremes(structure.level, structure.period),
    )


def of_random_walls(walls: Any, cell: float) -> Facts:
    """Facts of the walls of random cells `cell` mm wide on average: closed from the start, full where the widest is."""
    thin = 0.1
    distance = walls.sheet(thin).field + 0.5 * thin
    return Facts(pinch=0.0, full=2.0 * _extremes(distance, walls.period)[1] / cell)


def of_noise(waveform: Any) -> Facts:
    """Facts of a noise: biases that leave a thousandth on either side, in ten cells each way; its values stay within 1."""
    values = waveform.level(samples_of((10.0 * waveform.cell,) * 3, 2 * _NODES))
    low, high = np.quantile(values, (0.001, 0.999))
    return Facts(bias=(round(float(low), 2), round(float(high), 2)), range=(-1.0, 1.0))


def samples_of(period: Any, count: int = _NODES) -> np.ndarray:
    """(n, 3) nodes of one period."""
    axes = [np.arange(count) * p / count for p in period]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
