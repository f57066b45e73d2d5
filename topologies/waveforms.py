"""The formulas of the periodic surfaces: one period is 2 pi along each axis, the surface is where the sum is zero.

A formula takes three `Wave`s, one an axis, and is Field arithmetic of their harmonics, so that a wave can carry more than an
angle: its *drop* flattens the axis (LatticeRobot's drop parameters). Most are nodal approximations, the first terms of the
Fourier series of a minimal surface: close to it, not minimal themselves.

Sources, by the names used below:
    LF-rep: Letov (2023), Table 3.5. NASA: Schoen (1970), Infinite periodic minimal surfaces without self-intersections,
    TN D-5541 (the surfaces). Nesper: von Schnering and Nesper (1991), Nodal surfaces of Fourier series, Z. Phys. B 83, 407.
    Koch: Fischer and Koch (1987, 1989), Z. Krist. 179, 31 and 189, 101 (the surfaces S, C(S), C(Y)). Wohlgemuth: Wohlgemuth,
    Yufa, Hoffman and Thomas (2001), Macromolecules 34, 6083. Fisher: Fisher et al. (2023), Catalog of equation based lattice
    structures (collects the forms). K3DSurf: Taha, the formula collection of K3DSurf and MathMod. nTop: support article
    360053267814. LatticeRobot: the unit-cell parameter system.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from frep import Field, cos, sin, tanh


@dataclass(frozen=True)
class Wave:
    """The harmonics of one axis, at `angle` rad.

    `drop` is 1 for the formula as it stands and 0 for its mean over this axis, which is flat along it. At -1 the axis is
    mirrored where `mirrored` is set (formulas with sines; for those of cosines alone a mirror would change nothing), else
    moved by half a period.
    """

    angle: Field
    drop: Field | float = 1.0
    mirrored: bool = False

    def cos(self, n: int = 1) -> Field:
        """cos(n angle), weighed by the drop."""
        return self._power(2 if self.mirrored else n) * cos(n * self.angle)

    def sin(self, n: int = 1) -> Field:
        """sin(n angle), weighed by the drop."""
        return self._power(1 if self.mirrored else n) * sin(n * self.angle)

    def _power(self, n: int) -> Field | float:
        # Harmonic n by drop^n: half a period at -1, as it changes the sign of the odd ones. Mirrored: sines by drop,
        # cosines by its square, so that -1 changes the sign of the sines alone.
        return 1.0 if isinstance(self.drop, float) and self.drop == 1.0 else self.drop**n


Formula: TypeAlias = Callable[[Wave, Wave, Wave], Field]


def _cyclic(term: Formula, x: Wave, y: Wave, z: Wave) -> Field:
    return term(x, y, z) + term(y, z, x) + term(z, x, y)


def _singles(x: Wave, y: Wave, z: Wave, n: int = 1) -> Field:
    return _cyclic(lambda a, b, c: a.cos(n), x, y, z)


def _pairs(x: Wave, y: Wave, z: Wave, n: int = 1) -> Field:
    return _cyclic(lambda a, b, c: a.cos(n) * b.cos(n), x, y, z)


def _triple(x: Wave, y: Wave, z: Wave, n: int = 1) -> Field:
    return x.cos(n) * y.cos(n) * z.cos(n)


def _screws(x: Wave, y: Wave, z: Wave) -> Field:
    return _cyclic(lambda a, b, c: a.sin(2) * b.cos() * c.sin(), x, y, z)


def gyroid(x: Wave, y: Wave, z: Wave) -> Field:
    """Schoen's G: sin x cos y + sin y cos z + sin z cos x (LF-rep 3.7a; Nesper)."""
    return _cyclic(lambda a, b, c: a.sin() * b.cos(), x, y, z)


def schwarz_p(x: Wave, y: Wave, z: Wave) -> Field:
    """Schwarz's P: cos x + cos y + cos z (LF-rep Table 3.5; Nesper)."""
    return _singles(x, y, z)


def schwarz_d(x: Wave, y: Wave, z: Wave) -> Field:
    """Schwarz's D: cos x cos y cos z - sin x sin y sin z (LF-rep Table 3.5; Nesper)."""
    return _triple(x, y, z) - x.sin() * y.sin() * z.sin()


def neovius(x: Wave, y: Wave, z: Wave) -> Field:
    """Neovius' C(P): 3 (cos x + cos y + cos z) + 4 cos x cos y cos z (Nesper; nTop)."""
    return 3.0 * _singles(x, y, z) + 4.0 * _triple(x, y, z)


def iwp(x: Wave, y: Wave, z: Wave) -> Field:
    """Schoen's I-WP: 2 (cos x cos y + cos y cos z + cos z cos x) - (cos 2x + cos 2y + cos 2z) (NASA; Nesper)."""
    return 2.0 * _pairs(x, y, z) - _singles(x, y, z, 2)


def f_rd(x: Wave, y: Wave, z: Wave) -> Field:
    """Schoen's F-RD: 4 cos x cos y cos z - (cos 2x cos 2y + cos 2y cos 2z + cos 2z cos 2x) (NASA; Nesper)."""
    return 4.0 * _triple(x, y, z) - _pairs(x, y, z, 2)


def lidinoid(x: Wave, y: Wave, z: Wave) -> Field:
    """Lidin's surface: (sin 2x cos y sin z + cyclic) / 2 - (cos 2x cos 2y + cyclic) / 2 + 0.15 (Lidin and Larsson 1990,
    J. Chem. Soc. Faraday Trans. 86, 769, for the surface; nTop, Fisher for the form)."""
    return 0.5 * _screws(x, y, z) - 0.5 * _pairs(x, y, z, 2) + 0.15


def split_p(x: Wave, y: Wave, z: Wave) -> Field:
    """Split P: 1.1 (sin 2x cos y sin z + cyclic) - 0.2 (cos 2x cos 2y + cyclic) - 0.4 (cos 2x + cos 2y + cos 2z) (nTop,
    Fisher; the surface is Fogden and Hyde's)."""
    return 1.1 * _screws(x, y, z) - 0.2 * _pairs(x, y, z, 2) - 0.4 * _singles(x, y, z, 2)


def fischer_koch_s(x: Wave, y: Wave, z: Wave) -> Field:
    """Fischer and Koch's S: cos 2x sin y cos z + cos x cos 2y sin z + sin x cos y cos 2z (Koch; Nesper)."""
    return _cyclic(lambda a, b, c: a.cos(2) * b.sin() * c.cos(), x, y, z)


def fischer_koch_cy(x: Wave, y: Wave, z: Wave) -> Field:
    """Fischer and Koch's C(Y): (sin 2x sin y + cyclic) + (sin 2x cos z + cyclic) - sin x sin y sin z - cos x cos y cos z
    (Koch; Nesper)."""
    waves = _cyclic(lambda a, b, c: a.sin(2) * (b.sin() + c.cos()), x, y, z)
    return waves - x.sin() * y.sin() * z.sin() - _triple(x, y, z)


def fischer_koch_cs(x: Wave, y: Wave, z: Wave) -> Field:
    """Fischer and Koch's C(S): cos 2x + cos 2y + cos 2z + 2 (sin 3x sin 2y cos z + cyclic) + 2 (sin 2x cos 3y sin z + cyclic)
    (Koch; Nesper, Fisher)."""
    first = _cyclic(lambda a, b, c: a.sin(3) * b.sin(2) * c.cos(), x, y, z)
    second = _cyclic(lambda a, b, c: a.sin(2) * b.cos(3) * c.sin(), x, y, z)
    return _singles(x, y, z, 2) + 2.0 * (first + second)


def octo(x: Wave, y: Wave, z: Wave) -> Field:
    """Schoen's O,C-TO: 0.6 (cos x cos y + cyclic) - 0.4 (cos x + cos y + cos z) + 0.25 (NASA; Fisher)."""
    return 0.6 * _pairs(x, y, z) - 0.4 * _singles(x, y, z) + 0.25


def p_w_hybrid(x: Wave, y: Wave, z: Wave) -> Field:
    """P-W hybrid: 4 (cos x cos y + cyclic) - 3 cos x cos y cos z + 2.4 (K3DSurf)."""
    return 4.0 * _pairs(x, y, z) - 3.0 * _triple(x, y, z) + 2.4


def gyroid_prime(x: Wave, y: Wave, z: Wave) -> Field:
    """G': sin 2x cos y sin z + sin 2y cos z sin x + sin 2z cos x sin y + 0.32 (Nesper; K3DSurf, Fisher)."""
    return _screws(x, y, z) + 0.32


def diamond_prime(x: Wave, y: Wave, z: Wave) -> Field:
    """D': (cos x cos y cos z + (cos x sin y sin z + cyclic)) / 2 - (sin 2x sin 2y + cyclic) / 2 - 0.2 (Nesper; K3DSurf,
    Fisher)."""
    diamond = _triple(x, y, z) + _cyclic(lambda a, b, c: a.cos() * b.sin() * c.sin(), x, y, z)
    return 0.5 * diamond - 0.5 * _cyclic(lambda a, b, c: a.sin(2) * b.sin(2), x, y, z) - 0.2


def double_gyroid(x: Wave, y: Wave, z: Wave) -> Field:
    """Both skins of a thick gyroid: 2.75 (sin 2x cos y sin z + cyclic) - (cos 2x cos 2y + cyclic) (Wohlgemuth; Fisher)."""
    return 2.75 * _screws(x, y, z) - _pairs(x, y, z, 2)


def double_diamond(x: Wave, y: Wave, z: Wave) -> Field:
    """Both skins of a thick diamond: sin 2x sin 2y + sin 2y sin 2z + sin 2z sin 2x + cos 2x cos 2y cos 2z (Wohlgemuth;
    Fisher)."""
    return _cyclic(lambda a, b, c: a.sin(2) * b.sin(2), x, y, z) + _triple(x, y, z, 2)


def double_primitive(x: Wave, y: Wave, z: Wave) -> Field:
    """Both skins of a thick Schwarz P: 0.5 (cos x cos y + cyclic) + 0.2 (cos 2x + cos 2y + cos 2z) (Wohlgemuth; Fisher)."""
    return 0.5 * _pairs(x, y, z) + 0.2 * _singles(x, y, z, 2)


def scherk(x: Wave, y: Wave, z: Wave) -> Field:
    """Scherk's first surface, exp(z) cos y = cos x (Scherk 1835, J. reine angew. Math. 13, 185): minimal exactly, periodic in
    x and y alone. Divided by exp(z) + 1, so that it stays small far up and far down."""
    share = 0.5 * (1.0 + tanh(0.5 * z.angle))
    return share * y.cos() - (1.0 - share) * x.cos()


def primitive_gyroid_diamond(first: Field | float, second: Field | float) -> Formula:
    """Schwarz P (0, 0) through the gyroid (1, 0) to the diamond (1, 1), by the factors of the terms.

    sin x, sin x cos y and sin x cos y cos z lead the terms of the three; each cosine comes in as `1 - s + s cos`. The
    diamond's fourth term sin x sin y sin z grows with the second share. P and D are theirs of the other functions here,
    moved along (1, 1, 1). After LatticeRobot ("through the terms rather than by interpolating the fields").
    """

    def formula(x: Wave, y: Wave, z: Wave) -> Field:
        def term(a: Wave, b: Wave, c: Wave) -> Field:
            return a.sin() * (1.0 - first + first * b.cos()) * (1.0 - second + second * c.cos())

        return _cyclic(term, x, y, z) + second * (x.sin() * y.sin() * z.sin())

    return formula


def primitive_neovius(share: Field | float) -> Formula:
    """3 (cos x + cos y + cos z) + 4 share cos x cos y cos z: Schwarz P at 0, Neovius at 1, extrapolated beyond
    (LatticeRobot)."""
    return lambda x, y, z: 3.0 * _singles(x, y, z) + 4.0 * share * _triple(x, y, z)


@dataclass(frozen=True)
class Waveform:
    """What the catalogue knows of a formula.

    Attributes:
        formula: of three waves.
        mirrored: what a drop of -1 does: mirrors the axis, or moves it by half a period.
        complement_congruent: minus the formula is the formula moved (and perhaps mirrored), so that one side of the surface is
            the other one's shape.
        pinch, full: on the negative and the positive side of a surface of unit cell, the distance beyond which its channel
            falls into pockets (0: it is pockets) and the largest distance from the surface; found on a grid of 128 nodes,
            to about 0.005. A sheet that closes it is twice as thick: sqrt(2) / 3 for P, sqrt(3) / 4 for G, 0.350 for D.
            (lf-rep 3.4 has 0.415 and 0.325 for G and D, of paths along grid edges alone.)
    """

    formula: Formula
    pinch: tuple[float, float]
    full: tuple[float, float]
    mirrored: bool = False
    complement_congruent: bool = False


WAVEFORMS: dict[str, Waveform] = {
    "gyroid": Waveform(gyroid, (0.2165, 0.2165), (0.2298, 0.2298), mirrored=True, complement_congruent=True),
    "schwarz_p": Waveform(schwarz_p, (0.2357, 0.2357), (0.433, 0.433), complement_congruent=True),
    "schwarz_d": Waveform(schwarz_d, (0.1752, 0.1752), (0.2165, 0.2165), mirrored=True, complement_congruent=True),
    "neovius": Waveform(neovius, (0.0833, 0.0833), (0.4139, 0.4139), complement_congruent=True),
    "iwp": Waveform(iwp, (0.1767, 0.1713), (0.2139, 0.2861)),
    "f_rd": Waveform(f_rd, (0.0969, 0.0834), (0.2168, 0.2799)),
    "lidinoid": Waveform(lidinoid, (0.0512, 0.1137), (0.1221, 0.138), mirrored=True),
    "split_p": Waveform(split_p, (0.1078, 0.1268), (0.1245, 0.1616), mirrored=True),
    "fischer_koch_s": Waveform(
        fischer_koch_s, (0.1082, 0.1082), (0.1522, 0.1522), mirrored=True, complement_congruent=True
    ),
    "fischer_koch_cy": Waveform(
        fischer_koch_cy, (0.1285, 0.1285), (0.1768, 0.1768), mirrored=True, complement_congruent=True
    ),
    "fischer_koch_cs": Waveform(
        fischer_koch_cs, (0.0602, 0.0602), (0.1218, 0.1218), mirrored=True, complement_congruent=True
    ),
    "octo": Waveform(octo, (0.1168, 0.0803), (0.2408, 0.4376)),
    "p_w_hybrid": Waveform(p_w_hybrid, (0.0, 0.1716), (0.1512, 0.425)),
    "gyroid_prime": Waveform(gyroid_prime, (0.0834, 0.151), (0.0991, 0.1948), mirrored=True),
    "diamond_prime": Waveform(diamond_prime, (0.1277, 0.0713), (0.21, 0.0991), mirrored=True),
    "double_gyroid": Waveform(double_gyroid, (0.0944, 0.1191), (0.0973, 0.1337), mirrored=True),
    "double_diamond": Waveform(double_diamond, (0.0838, 0.0883), (0.0885, 0.1481), mirrored=True),
    "double_primitive": Waveform(double_primitive, (0.154, 0.0824), (0.1671, 0.2977)),
}
"""Every triply periodic formula, by name."""
