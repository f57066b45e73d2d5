"""Is a part still the part it was? Its numbers and its picture against the stored baseline, side by side."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from frep.mesh import Mesh

RELATIVE = {
    "volume": 1e-4,
    "area": 1e-4,
    "bounds": 3e-4,
    # A sample that is zero to the last bit may fall on either side on another processor.
    "triangles": 1e-3,
    "genus": 1e-2,
    "voxels evaluated": 0.05,
}
"""Allowed change as a part of the baseline; a number that is not listed must be equal."""

PICTURE_DIFFERENCE = 1.5
"""Allowed mean difference of two pictures, in grey levels of 255."""

PICTURE_SIMILARITY = 0.97
"""Least structural similarity of two pictures (SSIM, Wang et al. 2004)."""


@dataclass(frozen=True)
class Line:
    """One compared number."""

    name: str
    baseline: Any
    now: Any
    allowed: str
    good: bool


def numbers(mesh: Mesh, evaluated: int, settings: Mapping[str, Any]) -> dict[str, Any]:
    """What is compared of a part: size, volume, area, topology, and the settings it was made with."""
    report = mesh.check()
    return {
        **settings,
        "voxels evaluated": evaluated,
        "bounds": [[round(float(x), 4) for x in corner] for corner in mesh.bounds],
        "volume": round(mesh.volume, 3),
        "area": round(mesh.area, 3),
        "triangles": mesh.n_faces,
        "closed": report.closed,
        "manifold": report.manifold,
        "oriented": report.oriented,
        "components": report.components,
        "genus": report.genus,
    }


def compare_numbers(baseline: Mapping[str, Any], now: Mapping[str, Any]) -> list[Line]:
    """Line by line; a number that only one side has is a difference."""
    return [_line(name, baseline.get(name), now.get(name)) for name in dict.fromkeys([*baseline, *now])]


def _line(name: str, old: Any, new: Any) -> Line:
    share = RELATIVE.get(name)
    if share is None or old is None or new is None:
        return Line(name, old, new, "equal", old == new)
    a, b = np.asarray(old, float), np.asarray(new, float)
    good = a.shape == b.shape and bool(np.all(np.abs(a - b) <= share * np.max(np.abs(a), initial=1e-12)))
    return Line(name, old, new, f"{100 * share:g} %", good)


def compare_pictures(baseline: Path, now: Path) -> list[Line]:
    """Mean difference and structural similarity of two PNG files; pictures of different size differ."""
    from PIL import Image
    from skimage.metrics import structural_similarity

    old, new = (np.asarray(Image.open(path).convert("RGB"), dtype=np.float32) for path in (baseline, now))
    if old.shape != new.shape:
        return [Line("picture size", old.shape[:2], new.shape[:2], "equal", False)]
    difference = float(np.abs(old - new).mean())
    similarity = float(np.mean(structural_similarity(old, new, channel_axis=2, data_range=255)))
    near, alike = difference <= PICTURE_DIFFERENCE, similarity >= PICTURE_SIMILARITY
    return [
        Line("picture difference", 0.0, round(difference, 3), f"<= {PICTURE_DIFFERENCE}", near),
        Line("picture similarity", 1.0, round(similarity, 4), f">= {PICTURE_SIMILARITY}", alike),
    ]


def side_by_side(baseline: Path, now: Path, path: Path) -> None:
    """One picture of three: the baseline, the new one, and where they differ."""
    from PIL import Image

    from frep.io.atomic import replacing

    old, new = (Image.open(p).convert("RGB") for p in (baseline, now))
    new = new.resize(old.size)
    difference = np.abs(np.asarray(old, np.int16) - np.asarray(new, np.int16)).max(axis=2)
    marked = 255 - np.repeat(np.minimum(4 * difference, 255).astype(np.uint8)[..., None], 3, axis=2)
    with replacing(path) as temporary:
        Image.fromarray(np.hstack([np.asarray(old), np.asarray(new), marked])).save(temporary, format="PNG")


def read_numbers(path: Path) -> dict[str, Any]:
    """A baseline's numbers."""
    return json.loads(path.read_text())


def write_numbers(path: Path, values: Mapping[str, Any]) -> None:
    """Store a baseline's numbers, a line each, so that a change reads well as a difference."""
    from frep.io.atomic import replacing

    with replacing(path) as temporary:
        lines = (f" {json.dumps(name)}: {json.dumps(value)}" for name, value in values.items())
        temporary.write_text("{\n" + ",\n".join(lines) + "\n}\n")
