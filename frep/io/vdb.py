"""OpenVDB files: a sparse grid as a level set, and back.

`SparseGrid` has OpenVDB's layout, so this is a copy. OpenVDB itself has no wheel for today's Python; what is used
instead, in this order: the module `openvdb` or `pyopenvdb` of this interpreter, if a child process can import it (the
Debian build crashes an interpreter with numpy 2); the interpreter named by `FREP_OPENVDB_PYTHON`; the distribution's
own `python3`. The last two run a small worker, and the arrays travel in a temporary `.npz` file.
"""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from frep.errors import ArgumentError, FileError, MissingDependencyError
from frep.grid import SparseGrid
from frep.io.atomic import replacing

PYTHON_VARIABLE = "FREP_OPENVDB_PYTHON"
"""Environment variable: an interpreter that can import `openvdb` or `pyopenvdb`."""

_WORKER = Path(__file__).with_name("_vdb_worker.py")
_IN_PROCESS = ""


def write_vdb(path: str | os.PathLike[str], grid: SparseGrid, name: str = "surface") -> None:
    """Write a sparse grid as an OpenVDB level set, whole or not at all.

    Samples nearer than the background are active and bit for bit those of the grid; the others are inactive and become
    plus or minus the background, as OpenVDB has it. The transform holds voxel size and origin, in mm.

    Args:
        path: file name.
        grid: samples, mm, negative inside. A background that is not positive stands for three voxels.
        name: what the level set is called in the file.

    Raises:
        ArgumentError: the grid has no leaves, or samples that are not finite.
        FileError: the file cannot be written.
        MissingDependencyError: no OpenVDB; the message says what to install.
    """
    if not len(grid.leaves):
        raise ArgumentError("grid: it has no leaf blocks, so there is no surface to write")
    if not np.isfinite(grid.values).all():
        raise ArgumentError("grid: every sample must be finite")
    interpreter = provider()
    arrays = {
        "name": name,
        "origin": np.asarray(grid.origin, np.float64),
        "voxel": float(grid.voxel),
        "background": float(grid.background) if grid.background > 0 else 3.0 * float(grid.voxel),
        "table": grid.table,
        "leaves": grid.leaves,
        "values": grid.values,
    }
    with replacing(path) as temporary:
        if interpreter == _IN_PROCESS:
            from frep.io import _vdb_worker

            try:
                _vdb_worker.write(str(temporary), **arrays)
            except (RuntimeError, OSError, ValueError) as error:
                raise FileError(f"path: cannot write {os.fspath(path)!r}: {error}") from error
        else:
            with tempfile.TemporaryDirectory(prefix="frep-vdb-") as folder:
                exchange = Path(folder, "grid.npz")
                np.savez(exchange, **arrays)
                _run_worker(interpreter, "write", exchange, temporary, f"cannot write {os.fspath(path)!r}")


def read_vdb(path: str | os.PathLike[str]) -> SparseGrid:
    """Read the first float level set of an OpenVDB file.

    Args:
        path: file name. World units are taken as mm; voxels must be cubes along the axes.

    Raises:
        FileError: missing, damaged, or without such a level set.
        MissingDependencyError: no OpenVDB; the message says what to install.
    """
    file = Path(path)
    if not file.is_file():
        raise FileError(f"path: there is no file {os.fspath(path)!r}")
    interpreter = provider()
    if interpreter == _IN_PROCESS:
        from frep.io import _vdb_worker

        try:
            return _as_grid(_vdb_worker.read(str(file)))
        except (RuntimeError, OSError, ValueError, KeyError) as error:
            raise FileError(f"path: cannot read {os.fspath(path)!r}: {error}") from error
    with tempfile.TemporaryDirectory(prefix="frep-vdb-") as folder:
        exchange = Path(folder, "grid.npz")
        _run_worker(interpreter, "read", file, exchange, f"cannot read {os.fspath(path)!r}")
        with np.load(exchange) as data:
            return _as_grid(data)


def provider() -> str:
    """The interpreter that will run OpenVDB; the empty string for this one.

    Raises:
        MissingDependencyError: none can; the message says what to install.
    """
    return _find_provider(os.environ.get(PYTHON_VARIABLE, ""))


@functools.cache
def _find_provider(named: str) -> str:
    # A child tries first: a module built for another numpy kills its interpreter instead of raising.
    if (find_spec("openvdb") or find_spec("pyopenvdb")) and _answers(sys.executable, os.environ):
        return _IN_PROCESS
    for interpreter in (named, shutil.which("python3", path="/usr/bin:/bin:/usr/local/bin") or ""):
        if interpreter and _answers(interpreter, _foreign_environment()):
            return interpreter
    complaint = f" {PYTHON_VARIABLE}={named!r} is set, but that interpreter cannot import it." if named else ""
    raise MissingDependencyError(
        f"VDB files need OpenVDB's Python module, and no interpreter here can import it.{complaint} "
        "On Debian or Ubuntu: apt-get install python3-openvdb. Elsewhere: install openvdb for any Python (for example "
        f"conda install -c conda-forge openvdb) and set {PYTHON_VARIABLE} to that interpreter."
    )


def _foreign_environment() -> dict[str, str]:
    """Without the variables that would lead another interpreter to this one's packages."""
    return {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")}


def _answers(interpreter: str, environment: Mapping[str, str]) -> bool:
    try:
        command = [interpreter, str(_WORKER), "probe"]
        return subprocess.run(command, capture_output=True, env=environment, timeout=60, check=False).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


def _run_worker(interpreter: str, task: str, source: Path, result: Path, failure: str) -> None:
    command = [interpreter, str(_WORKER), task, str(source.resolve()), str(result.resolve())]
    done = subprocess.run(command, capture_output=True, env=_foreign_environment(), text=True, check=False)
    if done.returncode:
        lines = done.stderr.strip().splitlines() or [f"the OpenVDB worker ended with status {done.returncode}"]
        raise FileError(f"path: {failure}: {lines[-1]}")


def _as_grid(data: Mapping[str, Any]) -> SparseGrid:
    return SparseGrid(
        origin=np.asarray(data["origin"], np.float64),
        voxel=float(data["voxel"]),
        table=np.asarray(data["table"], np.int32),
        leaves=np.asarray(data["leaves"], np.int32),
        values=np.asarray(data["values"], np.float32),
        background=float(data["background"]),
    )
