"""A file is whole or it is the old one: planted failures of every kind, in the writer and in the system."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from frep.errors import FileError
from frep.io.atomic import check_target, replacing
from frep.mesh import Mesh

OLD = b"the old file"


def patch_of_faces(n: int) -> Mesh:
    vertices = np.random.default_rng(0).random((n + 2, 3))
    i = np.arange(n)
    return Mesh(vertices, np.stack([i, i + 1, i + 2], axis=1))


@pytest.fixture
def old(tmp_path) -> Path:
    path = tmp_path / "part.stl"
    path.write_bytes(OLD)
    return path


def assert_untouched(path: Path) -> None:
    assert path.read_bytes() == OLD
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_success_replaces_and_leaves_nothing_else(old):
    old.chmod(0o640)
    for durable in (False, True):
        with replacing(old, durable=durable) as temporary:
            assert temporary.parent == old.parent
            assert temporary.suffix == old.suffix
            temporary.write_bytes(b"new")
            assert old.read_bytes() == (b"new" if durable else OLD)
        assert old.read_bytes() == b"new"
    assert old.stat().st_mode & 0o777 == 0o640
    assert len(list(old.parent.iterdir())) == 1


def test_a_new_file_gets_the_usual_permissions(tmp_path):
    (tmp_path / "usual").touch()
    with replacing(tmp_path / "new.txt") as temporary:
        temporary.write_text("x")
    assert (tmp_path / "new.txt").stat().st_mode == (tmp_path / "usual").stat().st_mode


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, ZeroDivisionError, MemoryError])
def test_other_exceptions_pass_through(old, error):
    with pytest.raises(error), replacing(old) as temporary:
        temporary.write_bytes(b"half of the n")
        raise error
    assert_untouched(old)


def test_a_full_disk_is_a_file_error_that_says_so(old):
    with pytest.raises(FileError, match=r"part\.stl.*no space.*unchanged"), replacing(old) as temporary:
        temporary.write_bytes(b"half of the n")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert_untouched(old)


def test_a_library_may_remove_the_temporary_file_itself(old):
    with pytest.raises(FileError, match="No such file"), replacing(old) as temporary:
        temporary.unlink()
    assert_untouched(old)


def test_a_link_is_followed(tmp_path):
    real = tmp_path / "real.stl"
    real.write_bytes(OLD)
    link = tmp_path / "link.stl"
    link.symlink_to(real)
    with replacing(link) as temporary:
        temporary.write_bytes(b"new")
    assert link.is_symlink()
    assert real.read_bytes() == b"new"


def test_impossible_targets_are_refused_before_any_work(tmp_path):
    with pytest.raises(FileError, match=r"no folder.*missing"):
        check_target(tmp_path / "missing" / "part.stl")
    with pytest.raises(FileError, match="it is a folder"):
        check_target(tmp_path)
    with pytest.raises(FileError, match="device"):
        check_target("/dev/null")
    with pytest.raises(FileError, match="no folder"), replacing(tmp_path / "missing" / "part.stl"):
        pytest.fail("the body must not run")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_protected_targets_are_refused(old):
    old.chmod(0o444)
    with pytest.raises(FileError, match="write-protected"):
        check_target(old)
    old.parent.chmod(0o555)
    try:
        with pytest.raises(FileError, match="not writable"):
            check_target(old)
    finally:
        old.parent.chmod(0o755)


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj"])
@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_every_mesh_writer_keeps_the_old_file(tmp_path, monkeypatch, suffix, error):
    """The file object fails in its second write, with some of the file on the disk."""
    path = tmp_path / f"part{suffix}"
    path.write_bytes(OLD)
    original = Path.open
    writes = 0

    def opening(self, *args, **kwargs):
        file = original(self, *args, **kwargs)
        if self.parent != tmp_path or "b" not in str(args) + "b" or args[:1] == ("xb",):
            return file

        class Failing:
            def __enter__(self):
                return self

            def __exit__(self, *_):
                file.close()

            def seek(self, *where):
                return file.seek(*where)

            def write(self, data):
                nonlocal writes
                writes += 1
                if writes >= 2:
                    raise error
                return file.write(data)

        return Failing()

    monkeypatch.setattr(Path, "open", opening)
    with pytest.raises(FileError if isinstance(error, OSError) else KeyboardInterrupt):
        patch_of_faces(100_000).save(path)
    monkeypatch.undo()
    assert writes >= 2
    assert_untouched(path)


LIMITED = """
import resource, sys, pathlib, numpy as np
sys.path.insert(0, {tests!r})
from frep.errors import FileError
{prepare}
resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))
try:
    {save}
except FileError as error:
    print("FileError:", error)
else:
    print("no error")
"""

CASES = {
    "part.stl": ("from test_atomic import patch_of_faces\nmesh = patch_of_faces(50_000)", "mesh.save(path)"),
    "part.ply": ("from test_atomic import patch_of_faces\nmesh = patch_of_faces(50_000)", "mesh.save(path)"),
    "part.obj": ("from test_atomic import patch_of_faces\nmesh = patch_of_faces(50_000)", "mesh.save(path)"),
    "part.step": (
        "import pyvista as pv\nfrom frep.mesh import Mesh\nfrom frep.io.step import write_faceted_step\n"
        "mesh = Mesh.from_pyvista(pv.Icosphere(nsub=3))",
        "write_faceted_step(path, mesh)",
    ),
}


@pytest.mark.skipif(sys.platform == "win32", reason="limits of a process are POSIX")
@pytest.mark.parametrize("name", CASES)
def test_a_real_failing_write_keeps_the_old_file(tmp_path, name):
    """The system itself refuses to let the file grow, for our writers and for a library's."""
    path = tmp_path / name
    path.write_bytes(OLD)
    prepare, save = CASES[name]
    script = LIMITED.format(
        tests=str(Path(__file__).parent), prepare=f"path = {str(path)!r}\n{prepare}", save=save, limit=100_000
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, env=environment, check=False
    )
    assert done.stdout.startswith("FileError: path: cannot write"), done.stdout + done.stderr
    assert_untouched(path)
