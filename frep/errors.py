"""What can go wrong, named.

Every error that `frep` raises on purpose is a `FrepError`; its message names the argument, the value that came in and what
would be accepted. The subclasses let a script tell a bad request from a bad file or a bad user function.
"""

from __future__ import annotations

import os
import sys
import warnings


class FrepError(Exception):
    """Base of every error raised by `frep` on purpose."""


class ArgumentError(FrepError, ValueError):
    """An argument has a wrong value (non-finite, non-positive, wrong shape, out of range)."""


class ArgumentTypeError(FrepError, TypeError):
    """An argument has a wrong type: a Field where a number is needed, or the reverse."""


class UnboundedError(FrepError):
    """An infinite solid was asked for something that only a bounded one has (samples, a mesh, a volume)."""


class EmptyError(FrepError):
    """The solid holds no material at the sampled resolution."""


class TooLargeError(FrepError, MemoryError):
    """The work would not fit in memory; the message carries the estimate and a voxel size that fits."""


class FunctionError(FrepError):
    """A user function raised, or returned NaN or the wrong shape. The original exception is its `__cause__`.

    `point` is where, (x, y, z) in mm, if that is known.
    """

    point: tuple[float, float, float] | None = None


class FileError(FrepError, OSError):
    """A file cannot be read or written: missing, truncated, not of the kind it claims, no folder, no space."""


class MissingDependencyError(FrepError, ImportError):
    """A capability needs a library that is not here; the message says exactly what to install."""


class ThinWallWarning(UserWarning):
    """A wall or beam is thinner than two voxels, so that the grid may tear it."""


def warn(message: str, category: type[Warning]) -> None:
    """Warn at the line of the user's script, however deep in the packages the cause was found."""
    root = os.path.dirname(os.path.dirname(__file__))
    packages = tuple(os.path.join(root, name, "") for name in ("frep", "topologies", "graded", "conformal"))
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(packages):
        frame = frame.f_back
        level += 1
    warnings.warn(message, category, stacklevel=level)


class DisconnectedWarning(UserWarning):
    """A lattice falls into several parts, or beams of it end in the air, or much of it was left out because it hung loose."""
