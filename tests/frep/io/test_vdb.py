"""VDB: the round trip is exact in the band, the file is what OpenVDB calls a level set, damaged files are refused."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from frep.errors import ArgumentError, FileError, MissingDependencyError
from frep.grid import INSIDE, LEAF, OUTSIDE, SparseGrid
from frep.io import vdb


@pytest.fixture(scope="module", autouse=True)
def openvdb():
    try:
        return vdb.provider()
    except MissingDependencyError as error:
        if os.environ.get("CI"):
            pytest.fail(f"CI must have OpenVDB: {error}")
        pytest.skip(str(error))


def sampled(field, blocks, origin, voxel, background) -> SparseGrid:
    index = np.stack(np.indices([LEAF * n for n in blocks]), axis=-1)
    values = field(np.asarray(origin) + voxel * index).astype(np.float32)
    a, b, c = blocks
    split = values.reshape(a, LEAF, b, LEAF, c, LEAF).transpose(0, 2, 4, 1, 3, 5)
    band = (np.abs(split) < background).any(axis=(3, 4, 5))
    leaves = np.argwhere(band).astype(np.int32)
    table = np.where(split[..., 0, 0, 0] < 0, INSIDE, OUTSIDE).astype(np.int32)
    table[tuple(leaves.T)] = np.arange(len(leaves))
    return SparseGrid(np.asarray(origin, float), voxel, table, leaves, np.ascontiguousarray(split[band]), background)


def ball(p):
    return np.linalg.norm(p - [0.3, 0.2, 0.1], axis=-1) - 7.0


def thin_wall(p):
    return np.abs(p @ np.array([0.6, 0.64, 0.48])) - 0.05


def steep(p):
    """Jumps across the whole band between two samples: the sign of the far samples can't be had from neighbours."""
    return 40.0 * (np.sin(p[..., 0]) * np.cos(p[..., 1]) + np.sin(p[..., 1]) * np.cos(p[..., 2]) + 0.3)


CASES = {
    "ball": sampled(ball, (6, 6, 7), (-10, -10.5, -11.25), 0.4, 1.2),
    "thin wall, a box cut through": sampled(thin_wall, (3, 4, 3), (-5, -6, -4.7), 0.37, 1.0),
    "steep": sampled(steep, (4, 3, 5), (1e6, -3, 0.1), 0.25, 0.75),
}


@pytest.mark.parametrize("name", CASES)
def test_round_trip(tmp_path, name):
    grid = CASES[name]
    path = tmp_path / "part.vdb"
    vdb.write_vdb(path, grid)
    again = vdb.read_vdb(path)
    np.testing.assert_array_equal(again.table, grid.table)
    np.testing.assert_array_equal(again.leaves, grid.leaves)
    np.testing.assert_array_equal(again.origin, grid.origin)
    assert again.voxel == grid.voxel
    far = np.float32(grid.background)
    assert again.background == far
    # In the band bit for bit; beyond it the magnitude is the background, the sign is kept.
    np.testing.assert_array_equal(again.values, np.clip(grid.values, -far, far))
    assert len(list(tmp_path.iterdir())) == 1


def test_openvdb_itself_finds_a_level_set(tmp_path, openvdb):
    """Its own module, asked by a few lines of its own: class, voxels in use, transform, an inside tile."""
    grid = CASES["ball"]
    path = tmp_path / "part.vdb"
    vdb.write_vdb(path, grid, name="ball")
    script = (
        "import sys\ntry: import openvdb as v\nexcept ImportError: import pyopenvdb as v\n"
        "g = v.read(sys.argv[1], 'ball'); a = g.getConstAccessor()\n"
        "print(g.gridClass == v.GridClass.LEVEL_SET, g.activeVoxelCount(), *g.transform.indexToWorld((0, 0, 0)),\n"
        "      g.transform.voxelSize()[0], *a.probeValue((24, 24, 28)), *a.probeValue((-50, 0, 0)))"
    )
    done = subprocess.run(
        [openvdb or sys.executable, "-c", script, str(path)], capture_output=True, text=True, check=True,
        env={k: v for k, v in os.environ.items() if k != "PYTHONPATH"},
    )  # fmt: skip
    far = np.float32(1.2)
    active = int((np.abs(grid.values) < far).sum())
    level_set, count, *numbers = done.stdout.split()
    assert level_set == "True"
    assert int(count) == active
    x, y, z, size, inside, inside_on, outside, outside_on = numbers
    assert [float(v) for v in (x, y, z)] == grid.origin.tolist()
    assert float(size) == 0.4
    assert (float(inside), inside_on) == (-far, "False")
    assert (float(outside), outside_on) == (far, "False")


def test_a_background_that_is_none_stands_for_three_voxels(tmp_path):
    vdb.write_vdb(tmp_path / "part.vdb", replace(CASES["ball"], background=0.0))
    assert vdb.read_vdb(tmp_path / "part.vdb").background == np.float32(3 * 0.4)


def test_damaged_and_other_files_are_refused(tmp_path):
    good = tmp_path / "good.vdb"
    vdb.write_vdb(good, CASES["ball"])
    bad = tmp_path / "bad.vdb"
    for content in (b"", b"no vdb at all", good.read_bytes()[:-3000]):
        bad.write_bytes(content)
        with pytest.raises(FileError, match=r"cannot read.*bad\.vdb"):
            vdb.read_vdb(bad)
    with pytest.raises(FileError, match="no file"):
        vdb.read_vdb(tmp_path / "none.vdb")


def test_bad_grids_and_folders_are_refused_and_the_old_file_kept(tmp_path):
    path = tmp_path / "part.vdb"
    path.write_bytes(b"old")
    grid = CASES["ball"]
    with pytest.raises(ArgumentError, match="no leaf"):
        vdb.write_vdb(path, replace(grid, leaves=grid.leaves[:0], values=grid.values[:0]))
    values = grid.values.copy()
    values[0, 0, 0, 0] = np.nan
    with pytest.raises(ArgumentError, match="finite"):
        vdb.write_vdb(path, replace(grid, values=values))
    assert path.read_bytes() == b"old"
    with pytest.raises(FileError, match="no folder"):
        vdb.write_vdb(tmp_path / "missing" / "part.vdb", grid)


@pytest.mark.skipif(sys.platform == "win32", reason="limits of a process are POSIX")
def test_a_failing_write_of_openvdb_itself_is_noticed(tmp_path, openvdb):
    """OpenVDB does not report a file that cannot grow; the worker must."""
    exchange = tmp_path / "grid.npz"
    grid = CASES["ball"]
    np.savez(
        exchange, name="ball", origin=grid.origin, voxel=grid.voxel, background=grid.background, table=grid.table,
        leaves=grid.leaves, values=grid.values,
    )  # fmt: skip
    limited = (
        "import resource, runpy, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000));"
        "sys.argv = sys.argv[1:]; sys.path.insert(0, ''); runpy.run_path(sys.argv[0], run_name='__main__')"
    )
    done = subprocess.run(
        [openvdb or sys.executable, "-c", limited, vdb._WORKER, "write", exchange, tmp_path / "part.vdb"],
        capture_output=True, text=True, check=False, env={k: v for k, v in os.environ.items() if k != "PYTHONPATH"},
    )  # fmt: skip
    assert done.returncode != 0
    assert "incomplete" in done.stderr


def test_without_a_provider_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setattr(vdb, "_answers", lambda *_: False)
    vdb._find_provider.cache_clear()
    monkeypatch.setenv(vdb.PYTHON_VARIABLE, "/opt/none/python")
    try:
        with pytest.raises(MissingDependencyError, match=r"/opt/none/python(.|\n)*apt-get install python3-openvdb"):
            vdb.provider()
    finally:
        vdb._find_provider.cache_clear()


def test_the_order_of_providers(monkeypatch):
    """This interpreter if a child of it answers, then the one named, then the distribution's."""
    asked: list[str] = []

    def answers(interpreter, _environment):
        asked.append(interpreter)
        return interpreter == "/opt/named/python"

    monkeypatch.setattr(vdb, "_answers", answers)
    monkeypatch.setattr(vdb, "find_spec", lambda name: name == "pyopenvdb" or None)
    monkeypatch.setenv(vdb.PYTHON_VARIABLE, "/opt/named/python")
    vdb._find_provider.cache_clear()
    try:
        assert vdb.provider() == "/opt/named/python"
        assert asked == [sys.executable, "/opt/named/python"]
    finally:
        vdb._find_provider.cache_clear()
