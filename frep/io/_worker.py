"""Work in a process of its own: where OpenCASCADE crashes or never comes back, the user's Python lives on.

A crash of its booleans is a segmentation fault, which no `except` catches; and while it runs Python sees no Ctrl-C. The
process costs about a second and a half, so only what goes through booleans is sent there.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from frep.io._brep import BrepError

_START = "import pickle, sys; sys.path[:] = pickle.load(sys.stdin.buffer); from frep.io._worker import serve; serve()"


class TooLongError(BrepError):
    """The work was not done in its time."""


def apart(function: Callable[..., None], *arguments: Any, seconds: float, what: str) -> None:
    """Call a function of a module in another process; what it raises is raised here.

    It is called in this process where no other Python can be started (one that is part of another program).

    Args:
        function: by its name in its module; what it returns is dropped.
        arguments: anything that can be pickled.
        seconds: after which it is ended.
        what: names the work in messages.

    Raises:
        BrepError: the process crashed.
        TooLongError: it took more than `seconds`.
    """
    if not _is_plain_python():
        function(*arguments)
        return
    job = pickle.dumps(sys.path) + pickle.dumps((seconds, function, arguments))
    with subprocess.Popen(
        [sys.executable, "-c", _START],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        # Ctrl-C comes to this process only, which ends the other.
        start_new_session=True,
    ) as process:
        try:
            answer, _ = process.communicate(job, timeout=seconds)
        except subprocess.TimeoutExpired:
            raise TooLongError(
                f"{what}: OpenCASCADE did not unite them in {seconds:.0f} s. Take thinner or fewer beams, or write a "
                "faceted STEP file (from a mesh)"
            ) from None
        finally:
            if process.poll() is None:
                process.kill()
    if answer:
        error = pickle.loads(answer)
        if error is not None:
            raise error
    elif process.returncode == 1:  # it did not come so far as to serve
        function(*arguments)
    else:
        raise BrepError(
            f"{what}: OpenCASCADE crashed as it united them (exit {process.returncode}). Change the radii or the clip "
            "box by a few per cent, or write a faceted STEP file (from a mesh)"
        )


def _is_plain_python() -> bool:
    name = Path(sys.executable or "").name.lower()
    return name.startswith("python") and not getattr(sys, "frozen", False)


def serve() -> None:
    """In the other process: do the one job that stands in stdin, and answer with what it raised, or None."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # OpenCASCADE prints
    seconds, function, arguments = pickle.load(sys.stdin.buffer)
    if hasattr(signal, "alarm"):
        # Should the first process be killed, nobody waits for this one.
        signal.alarm(int(seconds) + 10)
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    found: Exception | None = None
    try:
        function(*arguments)
    except Exception as error:
        found = error
    with answers:
        answers.write(_pickled(found))
    # Past OpenCASCADE's own clearing up, which has crashed after the work was done.
    os._exit(0)


def _pickled(error: Exception | None) -> bytes:
    try:
        answer = pickle.dumps(error)
        pickle.loads(answer)
    except Exception:
        return pickle.dumps(BrepError(f"{type(error).__name__}: {error}"))
    return answer
