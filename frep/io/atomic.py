"""Whole files or none: every file of the project is written through `replacing`.

Promises: until the new file is complete the old one is untouched, under its name; after a failure of any kind (no
space, an exception, Ctrl-C) the old file is still there and nothing else is left behind. It does not promise that the
new file survives a power cut (that takes `durable=True`), nor can it clean up after a killed process.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path

from frep.errors import FileError


def check_target(path: str | os.PathLike[str]) -> Path:
    """Say now, before the work, whether a file can be written at `path`.

    Args:
        path: the file to be written. A link is followed: the file it points to is the one that will be replaced.

    Returns:
        The absolute path of the file itself.

    Raises:
        FileError: its folder does not exist or admits no new file, or the path is a folder, a device, or
            write-protected.
    """
    target = Path(os.path.realpath(path))
    folder = target.parent
    if not folder.is_dir():
        raise FileError(f"path: cannot write {str(path)!r}: there is no folder {str(folder)!r}; make it first")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise FileError(f"path: cannot write {str(path)!r}: the folder {str(folder)!r} is not writable")
    if target.exists():
        if target.is_dir():
            raise FileError(f"path: cannot write {str(path)!r}: it is a folder; give a file name")
        if not stat.S_ISREG(target.stat().st_mode):
            raise FileError(
                f"path: cannot write {str(path)!r}: it is a device or a pipe; give the name of a plain file"
            )
        if not os.access(target, os.W_OK):
            raise FileError(f"path: cannot write {str(path)!r}: the file there is write-protected")
    return target


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str], *, durable: bool = False) -> Iterator[Path]:
    """Give the caller a temporary file to fill, then put it in the place of `path` in one step.

    The temporary file lies in the same folder (so that the step is a rename) and carries the same suffix (so that a
    library which goes by the suffix writes the right format). It exists and is empty on entry; open it, or hand its
    name on.

    Args:
        path: the file to be written.
        durable: wait until the disk holds the data before renaming.

    Yields:
        The path of the temporary file.

    Raises:
        FileError: `path` cannot be written (see `check_target`), or writing failed: no space, no permission. The old
            file is intact then, as it is after any other exception, which passes through.
    """
    target = check_target(path)
    temporary = target.with_name(f".{target.stem[:100]}.{secrets.token_hex(6)}{target.suffix}")
    try:
        try:
            # "x": never an existing file; the permissions are those that any new file of this user gets.
            temporary.open("xb").close()
            yield temporary
            if target.exists():
                shutil.copymode(target, temporary)
            if durable:
                _flush_to_disk(temporary)
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)
    except FileError:
        raise
    except OSError as error:
        raise _explained(error, path) from error


def _flush_to_disk(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def _explained(error: OSError, path: str | os.PathLike[str]) -> FileError:
    reason = error.strerror or str(error)
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        reason = "no space left on the disk; free some, or write to another folder"
    elif error.errno == errno.EFBIG:
        reason = "the file is larger than the disk or a limit of this process allows"
    return FileError(f"path: cannot write {os.fspath(path)!r}: {reason}; a file that was there is unchanged")
