"""What the gallery shows, and in what form each entry is compared with its baseline."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
BASELINES = FOLDER / "baselines"
PICTURES = FOLDER / "pictures"
_DATA = FOLDER.parent.parent / "shared" / "data"


@dataclass(frozen=True)
class Entry:
    """A picture of the gallery.

    Attributes:
        name: of the picture and of the baseline.
        script: the design file in this folder, without its suffix.
        shown: parameters for the picture, beyond the script's defaults.
        cut: further parameters for the picture only: the table and the file are of the whole part.
        compared: parameters for the comparison, picture and numbers; smaller, so that a check takes seconds.
        needs: a file that is not part of the repository.
    """

    name: str
    script: str
    shown: Mapping[str, str] = field(default_factory=dict)
    cut: Mapping[str, str] = field(default_factory=dict)
    compared: Mapping[str, str] = field(default_factory=dict)
    needs: Path | None = None

    @property
    def path(self) -> Path:
        """The design file."""
        return FOLDER / f"{self.script}.py"

    @property
    def missing(self) -> str | None:
        """Why this entry cannot be made here, if so."""
        if self.needs is not None and not self.needs.exists():
            return f"{self.needs.name} is not here (looked for it in {self.needs.parent})"
        return None


_BUNNY, _CT, _FE = _DATA / "bunny.ply", _DATA / "head_ct.vti", _DATA / "notch_stress.vtk"

ENTRIES = (
    Entry("bcc_parabola", "bcc_parabola", compared={"length": "100"}),
    Entry("schwarz_p_linear", "schwarz_p_linear", compared={"size": "60"}),
    Entry("schwarz_p_sine", "schwarz_p_sine", compared={"wide": "2", "high": "6"}),
    Entry("fcc_section", "fcc_section", compared={"ny": "3", "nz": "3", "voxel": "0.2"}),
    Entry("bain", "bain", compared={"p": "4"}),
    Entry("truncation", "truncation", compared={"n": "3", "thin": "1.0", "voxel": "0.4"}),
    Entry(
        "truncation_rco",
        "truncation",
        shown={"kind": "rhombicuboctahedron", "title": "Rhombicuboctahedra, 0 to u/2 along z"},
        compared={"kind": "rhombicuboctahedron", "n": "3", "thin": "1.0", "voxel": "0.4"},
    ),
    Entry("gyroid_to_p", "gyroid_to_p", compared={"length": "3", "wide": "1", "voxel": "0.25"}),
    Entry("lattice_query", "lattice_query", compared={"Nx": "2", "Ny": "2", "Nz": "6"}),
    Entry("infill", "infill", cut={"cut": "z"}, compared={"size": "100", "cut": "z"}),
    Entry(
        "infill_bunny",
        "infill",
        shown={"body": str(_BUNNY), "size": "120"},
        cut={"cut": "z"},
        compared={"body": str(_BUNNY), "size": "60", "cut": "z"},
        needs=_BUNNY,
    ),
    Entry("voronoi", "voronoi", compared={"size": "16"}),
    Entry("packed_foam", "packed_foam", compared={"size": "12"}),
    Entry("spinodal", "spinodal", compared={"size": "16"}),
    Entry("beam_cells", "beam_cells", compared={"across": "1", "voxel": "0.6"}),
    Entry(
        "surfaces",
        "surfaces",
        compared={"wall": "0.9", "across": "1", "pitch": "17", "scale": "gradient", "voxel": "0.45"},
    ),
    Entry(
        "surfaces_solid",
        "surfaces",
        shown={"wall": "0", "title": "Surfaces of the catalogue, one side"},
        compared={"wall": "0", "across": "1", "pitch": "17", "scale": "gradient", "voxel": "0.45"},
    ),
    Entry("foams", "foams", compared={"across": "1", "voxel": "0.6"}),
    Entry("ct_graded", "ct_graded", shown={"ct": str(_CT)}, compared={"ct": str(_CT), "voxel": "1.6"}, needs=_CT),
    Entry(
        "fe_graded",
        "fe_graded",
        shown={"results": str(_FE)},
        compared={"results": str(_FE), "voxel": "0.6"},
        needs=_FE,
    ),
    Entry("michell", "lattices/michell"),
    Entry("spring_tire", "lattices/spring_tire", compared={"halves": "5", "springs": "20", "voxel": "0.5"}),
    Entry("octet", "lattices/octet", compared={"wide": "2", "long": "10", "voxel": "0.2"}),
    Entry("honeycomb", "lattices/honeycomb"),
    Entry("figure_6_3", "lattices/figure_6_3", compared={"nu": "4", "nv": "5", "nw": "5", "voxel": "0.04"}),
    Entry("lattice_in_lattice", "lattice_in_lattice", compared={"cells": "12", "voxel": "0.12"}),
    Entry("girders", "girders", compared={"voxel": "0.2"}),
    Entry("sandwich", "sandwich", compared={"size": "14", "voxel": "0.16"}),
    Entry("billion", "lattices/billion", compared={"window": "3"}),
)


def entry(name: str) -> Entry:
    """The entry of that name.

    Raises:
        ArgumentError: there is none.
    """
    from frep.errors import ArgumentError

    for candidate in ENTRIES:
        if candidate.name == name:
            return candidate
    raise ArgumentError(f"only: no entry {name!r}; there are {', '.join(e.name for e in ENTRIES)}")
