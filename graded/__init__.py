"""Parameter fields `P`: how a thickness, a diameter or a blend varies through the part.

Every law is a Field; anything else that is a function of position will do in its place: `1 + 5 * frep.sin(x / 20) **
2`, a Python function, a table.
"""

from .data import distance_to, from_grid, from_image, from_points
from .laws import axial, linear, parabola, piecewise, power, radial, sine, smoothstep, step, table
from .mesh_data import from_mesh_data
from .remap import remap, smoothed, thickness_for, volume_fraction_curve
from .sampling_rules import at_foot, at_nodes, per_cell

__all__ = [
    "at_foot",
    "at_nodes",
    "axial",
    "distance_to",
    "from_grid",
    "from_image",
    "from_mesh_data",
    "from_points",
    "linear",
    "parabola",
    "per_cell",
    "piecewise",
    "power",
    "radial",
    "remap",
    "sine",
    "smoothed",
    "smoothstep",
    "step",
    "table",
    "thickness_for",
    "volume_fraction_curve",
]
