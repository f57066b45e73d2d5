"""Parameter fields `P`: how a thickness, a diameter or a blend varies through the part, and one structure into another.

Every law is a Field; anything else that is a function of position will do in its place: `1 + 5 * frep.sin(x / 20) **
2`, a Python function, a table.
"""

from .data import distance_to, from_grid, from_image, from_points
from .laws import axial, linear, parabola, parabola_thesis, piecewise, power, radial, sine, smoothstep, step, table
from .mesh_data import from_mesh_data
from .regions import regions
from .remap import remap, smoothed, thickness_for, volume_fraction_curve
from .sampling_rules import along_beams, at_foot, at_nodes, per_cell
from .transition import connection_report, mixture, transition

__all__ = [
    "along_beams",
    "at_foot",
    "at_nodes",
    "axial",
    "connection_report",
    "distance_to",
    "from_grid",
    "from_image",
    "from_mesh_data",
    "from_points",
    "linear",
    "mixture",
    "parabola",
    "parabola_thesis",
    "per_cell",
    "piecewise",
    "power",
    "radial",
    "regions",
    "remap",
    "sine",
    "smoothed",
    "smoothstep",
    "step",
    "table",
    "thickness_for",
    "transition",
    "volume_fraction_curve",
]
