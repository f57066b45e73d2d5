"""Parameter fields `P`: how a thickness, a diameter or a blend varies through the part.

Every law is a Field; anything else that is a function of position will do in its place: `1 + 5 * frep.sin(x / 20) ** 2`, a
Python function, a table.
"""

from .data import distance_to
from .laws import linear, parabola

__all__ = ["distance_to", "linear", "parabola"]
