"""Files of steady lattices: the model as JSON, exact and small; or all balls and beams as text, for other programs.

**Text** (`.txt`): what the programmed-lattice editor exports, "a list of center and radius of each ball and a list of pair of
ball indices for each beam", laid down as follows. ASCII, lines end in a line feed, numbers stand apart by single spaces.

    # comment lines, any number of them, up to 1000 characters long
    balls 2
    0.0 0.0 0.0 1.5
    10.0 0.0 0.0 1.5
    beams 1
    0 1

The line `balls n` is followed by n lines `x y z radius`, in mm, with as many digits as give the same float64 again; the line
`beams m` by m lines of two ball numbers, counted from 0. Nothing follows. Balls are ordered by cluster (i, j, k), k fastest, then
by node, those without beams among them; beams come in the order of `SteadyLattice.beams`.

**JSON** (`.json`): the model itself, a few hundred bytes whatever the counts. Floats have as many digits as give the same float64
again, so that what is read is what was written, bit for bit:

    {"format": "frep steady lattice", "version": 1, "unit": "mm", "nodes": [[x, y, z], ...], "radii": [r, ...],
     "racks": [[start node, end node, di, dj, dk], ...], "counts": [..., ..., ...], "start": [..., ..., ...],
     "u": {"log_scale": ..., "angle": ..., "axis": [...], "velocity": [...]}, "v": {...}, "w": {...}}

Every file is written whole or not at all. Source: Gupta et al., *Programmed-Lattice Editor and accelerated computation of mass
properties of steady lattices*, 7.1.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np

from frep.errors import ArgumentError, FileError, FrepError, TooLargeError
from frep.io.atomic import check_target, replacing
from frep.progress import progress
from frep.similarity import Similarity

from .steady_explicit import BallsAndBeams

if TYPE_CHECKING:
    from topologies.steady import SteadyLattice

FORMAT, VERSION = "frep steady lattice", 1

SUFFIXES = (".json", ".txt", ".py")
"""What `save` writes."""

MOST = 50_000_000
"""Beams that `write_text` writes without being told to: about 2.5 GB."""

_CHUNK = 65_536  # lines at a time: a few MB


def save(lattice: SteadyLattice, path: str | os.PathLike[str], *, most: int | None = MOST) -> None:
    """Write a lattice in the format that the suffix names: `.json` (the model), `.txt` (balls and beams), `.py` (a program).

    Args:
        lattice: the lattice.
        path: the file; an old one is replaced only by a complete new one.
        most: for `.txt`: how many beams may be written; None for any number.

    Raises:
        FileError: an unknown suffix, or the file cannot be written.
        TooLargeError: a text file of more than `most` beams.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise FileError(f"path: {os.fspath(path)!r} does not end in a known suffix; known are {', '.join(SUFFIXES)}")
    if suffix == ".json":
        write_json(lattice, path)
    elif suffix == ".txt":
        write_text(lattice, path, most=most)
    else:
        from topologies.steady_program import program_text

        with replacing(path) as temporary:
            temporary.write_text(program_text(lattice), encoding="utf-8")


# Balls and beams


def write_text(lattice: SteadyLattice, path: str | os.PathLike[str], *, most: int | None = MOST) -> None:
    """Write all balls and beams of a lattice as text (see the module), in blocks: memory does not grow with the lattice.

    Args:
        lattice: the lattice; a part of it is `lattice.region(start, span)`.
        path: the file.
        most: how many beams, or balls, may be written; None for any number.

    Raises:
        TooLargeError: more than `most` beams or balls.
        FileError: the file cannot be written.
    """
    pairs = (ball_numbers(lattice, block) for block in lattice.beams(_CHUNK))
    write_blocks(path, (lattice.n_nodes, lattice.n_beams), _ball_blocks(lattice), pairs, most)


def write_blocks(
    path: str | os.PathLike[str],
    numbers: tuple[int, int],
    balls: Iterable[np.ndarray],
    pairs: Iterable[np.ndarray],
    most: int | None,
) -> None:
    """Write a text file from blocks of balls (m, 4) and of beams (m, 2): `numbers` of them in all. Raises as `write_text`."""
    n_nodes, n_beams = numbers
    if most is not None and max(numbers) > most:
        raise TooLargeError(
            f"lattice: it has {n_nodes:,} balls and {n_beams:,} beams, and most={most:,} may be written; "
            "write lattice.region(start, span), or pass most=None"
        )
    check_target(path)
    with (
        progress("writing", total=sum(numbers)) as advance,
        replacing(path) as temporary,
        temporary.open("w", encoding="ascii", newline="\n") as file,
    ):
        file.write("# steady lattice, mm: balls (x y z radius), beams (two ball numbers from 0)\n")
        for word, number, row, blocks in (
            ("balls", n_nodes, "%r %r %r %r\n", balls),
            ("beams", n_beams, "%d %d\n", pairs),
        ):
            file.write(f"{word} {number}\n")
            for block in blocks:
                file.write(row * len(block) % tuple(block.ravel().tolist()))
                advance(len(block))


def ball_numbers(lattice: SteadyLattice, beams: np.ndarray) -> np.ndarray:
    """The numbers, in a text file, of the two balls of beams.

    Args:
        lattice: the lattice that the file holds.
        beams: (m, 4) int64 rows (i, j, k, rack), as the lattice's queries and filters give them.

    Returns:
        (m, 2) int64.
    """
    rows = lattice.racks[beams[:, 3]]
    first = beams[:, :3] - lattice.start
    _, cj, ck = (int(n) for n in lattice.counts)
    numbers = []
    for index, node in ((first, rows[:, 0]), (first + rows[:, 2:5], rows[:, 1])):
        cluster = (index[:, 0] * cj + index[:, 1]) * ck + index[:, 2]
        numbers.append(cluster * len(lattice.nodes) + node)
    return np.stack(numbers, axis=1)


def _ball_blocks(lattice: SteadyLattice) -> Iterator[np.ndarray]:
    """All balls, (m, 4) rows (x, y, z, radius) at a time."""
    _, cj, ck = (int(n) for n in lattice.counts)
    clusters = math.prod(int(n) for n in lattice.counts)
    step = max(_CHUNK // len(lattice.nodes), 1)
    for begin in range(0, clusters, step):
        flat = np.arange(begin, min(begin + step, clusters))
        i, j, k = flat // (cj * ck), flat // ck % cj, flat % ck
        centers, radii = lattice.balls(i + lattice.start[0], j + lattice.start[1], k + lattice.start[2])
        yield np.concatenate([centers.reshape(-1, 3), radii.reshape(-1, 1)], axis=1)


def read_text(path: str | os.PathLike[str]) -> BallsAndBeams:
    """Read balls and beams from a text file (see the module).

    Raises:
        FileError: no such file, or not of that form; the message says what is wrong in which line.
    """
    lines = _Lines(path)
    with lines.opened() as file:
        balls = lines.table(file, lines.heading(file, "balls"), 4, np.float64)
        lines.require(np.all(np.isfinite(balls), axis=1), "numbers that are finite")
        lines.require(balls[:, 3] > 0.0, "a radius above 0")
        edges = lines.table(file, lines.heading(file, "beams"), 2, np.int64)
        lines.require(np.all((edges >= 0) & (edges < len(balls)), axis=1), f"ball numbers from 0 to {len(balls) - 1}")
        lines.require(edges[:, 0] != edges[:, 1], "two different balls")
        if file.read(1):
            raise lines.error(lines.number + 1, "expected the end of the file: all beams have been read")
    return BallsAndBeams(np.ascontiguousarray(balls[:, :3]), np.ascontiguousarray(balls[:, 3]), edges)


class _Lines:
    """A text file being read: it knows in which line it is."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = path
        self.number = 0
        self.first = 0  # line of the first row of the last table

    def error(self, line: int, text: str) -> FileError:
        return FileError(f"path: {os.fspath(self.path)!r}, line {line}: {text}")

    def opened(self) -> TextIO:
        try:
            # latin-1 takes every byte, so that what is no text is refused where it stands.
            return Path(self.path).open(encoding="latin-1", newline="\n")
        except OSError as error:
            raise FileError(f"path: cannot read {os.fspath(self.path)!r}: {error.strerror or error}") from error

    def heading(self, file: TextIO, word: str) -> int:
        line = "#"
        while line.startswith("#"):
            line = file.readline(1000)
            self.number += 1
        words = line.split()
        if len(words) != 2 or words[0] != word or not (words[1].isascii() and words[1].isdigit()):
            raise self.error(self.number, f"expected '{word} <how many>', got {_shown(line)}")
        return int(words[1])

    def table(self, file: TextIO, rows: int, columns: int, dtype: type) -> np.ndarray:
        self.first = self.number + 1
        blocks = [np.empty((0, columns), dtype)]
        left = rows
        while left:
            lines = list(islice(file, min(left, _CHUNK)))
            blocks.append(self._block(lines, columns, dtype))
            self.number += len(lines)
            left -= len(lines)
            if left and len(lines) < _CHUNK:
                raise self.error(self.number + 1, f"the file ends {left:,} lines early: it announces {rows:,} of them")
        return np.concatenate(blocks)

    def _block(self, lines: list[str], columns: int, dtype: type) -> np.ndarray:
        kind = float if dtype is np.float64 else int
        try:
            flat = np.array([kind(word) for line in lines for word in line.split()], dtype)
            if len(flat) == columns * len(lines):
                table = flat.reshape(-1, columns)
                # A number too many here and one too few there: only where each line has its own.
                if all(line.count(" ") == columns - 1 for line in lines):
                    return table
        except (ValueError, OverflowError):
            pass
        for offset, line in enumerate(lines):
            words = line.split()
            try:
                good = len(np.array([kind(word) for word in words], dtype)) == columns
            except (ValueError, OverflowError):
                good = False
            if not good or line.count(" ") != columns - 1:
                numbers = "numbers" if kind is float else "whole numbers"
                raise self.error(
                    self.number + 1 + offset, f"expected {columns} {numbers}, single spaces apart, got {_shown(line)}"
                )
        raise AssertionError("unreachable: one line is bad")

    def require(self, good: Any, expected: str) -> None:
        bad = np.flatnonzero(~good)
        if len(bad):
            raise self.error(self.first + int(bad[0]), f"expected {expected}")


def _shown(line: str) -> str:
    text = line.rstrip("\n")
    return repr(text if len(text) <= 60 else text[:57] + "...") if line else "the end of the file"


# The model


def write_json(lattice: SteadyLattice, path: str | os.PathLike[str]) -> None:
    """Write the model of a lattice as JSON (see the module): read back, it is the same lattice bit for bit.

    Raises:
        FileError: the file cannot be written.
    """
    model = {
        "format": FORMAT,
        "version": VERSION,
        "unit": "mm",
        "nodes": lattice.nodes.tolist(),
        "radii": lattice.radii.tolist(),
        "racks": lattice.racks.tolist(),
        "counts": [int(n) for n in lattice.counts],
        "start": [int(n) for n in lattice.start],
        **{name: _numbers(s) for name, s in zip("uvw", lattice.skeleton.directions, strict=True)},
    }
    body = ",\n".join(f" {json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in model.items())
    with replacing(path) as temporary:
        temporary.write_text(f"{{\n{body}\n}}\n", encoding="ascii")


def _numbers(similarity: Similarity) -> dict[str, Any]:
    return {
        "log_scale": float(similarity.log_scale),
        "angle": float(similarity.angle),
        "axis": similarity.axis.tolist(),
        "velocity": similarity.velocity.tolist(),
    }


def read_json(path: str | os.PathLike[str]) -> SteadyLattice:
    """Read the model of a lattice from JSON (see the module).

    Raises:
        FileError: no such file, not JSON (the message names the line), not a lattice of a known version, or one that makes no
            sense (it names the entry).
    """
    name = os.fspath(path)
    try:
        text = Path(path).read_bytes()
    except OSError as error:
        raise FileError(f"path: cannot read {name!r}: {error.strerror or error}") from error
    try:
        model = json.loads(text)
    except json.JSONDecodeError as error:
        raise FileError(f"path: {name!r}, line {error.lineno}: not JSON: {error.msg}") from error
    except (UnicodeDecodeError, RecursionError) as error:
        raise FileError(f"path: {name!r} is not JSON text: {error}") from error
    if not isinstance(model, dict) or model.get("format") != FORMAT:
        raise FileError(f'path: {name!r} is no steady lattice; expected an object with "format": "{FORMAT}"')
    if model.get("version") != VERSION:
        raise FileError(f"path: {name!r} is of version {model.get('version')!r}; this program reads version {VERSION}")
    try:
        return _lattice(model)
    except KeyError as error:
        raise FileError(f"path: {name!r} has no entry {error}") from error
    except (FrepError, TypeError, ValueError, OverflowError) as error:
        raise FileError(f"path: {name!r} holds no lattice: {error}") from error


def _lattice(model: dict[str, Any]) -> SteadyLattice:
    from topologies.steady import SteadyLattice

    if model["unit"] != "mm":
        raise ArgumentError(f'unit: expected "mm", got {model["unit"]!r}')
    counts, start, racks = model["counts"], model["start"], model["racks"]
    for name, length, rows in (("counts", 3, [counts]), ("start", 3, [start]), ("racks", 5, racks)):
        if not all(len(row) == length and all(type(n) is int for n in row) for row in rows):
            raise ArgumentError(
                f"{name}: expected {length} whole numbers{' a row' if name == 'racks' else ''}, got {rows!r:.100}"
            )
    if min(counts) < 1:
        raise ArgumentError(f"counts: expected at least 1 each, got {counts}")
    u, v, w = (Similarity(**model[key]) for key in ("u", "v", "w"))
    room = room_for(counts, racks)
    return SteadyLattice(model["nodes"], model["radii"], racks, u, v, w, room, start).region(start, counts)


def room_for(counts: Any, racks: Any) -> tuple[int, ...]:
    """The least counts into which every rack fits: a region may be smaller than its racks reach, a whole lattice not."""
    reach = np.abs(np.reshape(np.asarray(racks, np.int64), (-1, 5))[:, 2:]).max(axis=0, initial=0)
    return tuple(int(n) for n in np.maximum(counts, reach + 1))
