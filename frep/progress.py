"""How long is it going to take, and where did the time go.

`progress` shows a bar for work that takes more than two seconds, and only where somebody looks: on a terminal. `Stages`
collects the seconds of every `progress` block that runs inside it, so that a part of the kernel names its work once and
gets both the bar and a line in the closing table.
"""

from __future__ import annotations

import contextlib
import contextvars
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from rich.progress import Progress

DELAY = 2.0
"""Seconds of work before a bar is worth its place on the screen."""

_stages: contextvars.ContextVar[Stages | None] = contextvars.ContextVar("frep_stages", default=None)


@dataclass(eq=False)
class Stages:
    """Seconds by stage of one job; use it as a context manager around the job.

    A stage that contains another keeps only its own seconds, so that the stages add up to the whole.

    Attributes:
        seconds: seconds by stage name, in the order of first use.
    """

    seconds: dict[str, float] = field(default_factory=dict)
    _open: list[float] = field(default_factory=list, repr=False)
    _token: contextvars.Token[Stages | None] | None = field(default=None, repr=False)

    def __enter__(self) -> Stages:
        # A process that does several jobs tells each one's own peak, where the system (Linux) can forget the last one's.
        with contextlib.suppress(OSError):
            Path("/proc/self/clear_refs").write_text("5")
        self._token = _stages.set(self)
        return self

    def __exit__(self, *_: object) -> None:
        if self._token is not None:
            _stages.reset(self._token)
            self._token = None

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count the seconds of the block under `name`."""
        self.seconds.setdefault(name, 0.0)
        self._open.append(0.0)
        start = time.perf_counter()
        try:
            yield
        finally:
            elapsed = time.perf_counter() - start
            self.seconds[name] += elapsed - self._open.pop()
            if self._open:
                self._open[-1] += elapsed

    @property
    def total(self) -> float:
        """Seconds of all stages together."""
        return sum(self.seconds.values())


def closing_table(title: str, facts: Mapping[str, str], stages: Stages, *, stream: TextIO | None = None) -> None:
    """Print what was made, where the seconds went and how much memory it took.

    Args:
        title: the table's heading.
        facts: what there is to say about the result, a line each, already formatted.
        stages: the finished job's stages.
        stream: where to print; stdout where None.
    """
    from rich.console import Console
    from rich.table import Table

    table = Table(show_header=False)
    table.add_column(style="cyan")
    table.add_column(justify="right")
    for name, value in facts.items():
        table.add_row(name, value)
    table.add_section()
    for name, seconds in stages.seconds.items():
        table.add_row(f"{name}, s", f"{seconds:.2f}")
    table.add_row("all stages, s", f"{stages.total:.2f}")
    table.add_row("peak memory, MB", f"{peak_memory() / 1e6:,.0f}")
    console = Console(file=stream)
    console.print(title, style="bold", markup=False, highlight=False)
    console.print(table)


@contextmanager
def progress(name: str, *, total: float | None = None) -> Iterator[Callable[[float], None]]:
    """A progress bar on stderr for a block of work, shown once the work has taken two seconds.

    Args:
        name: what is being done, in a word or two; also the stage's name in the closing table.
        total: the amount of work, in any unit; None where it is unknown (the bar then only pulses).

    Yields:
        A function that is told how much work was done since it was last called. It may be called from any thread.

    The bar appears only where stderr is a terminal; the environment variable `FREP_PROGRESS` set to 1 or 0 decides
    otherwise. It is drawn by a thread of its own, so it also appears while a single long call is under way.
    """
    stages = _stages.get()
    bar = _Bar(name, total) if _wanted(sys.stderr) else None
    timer = None
    if bar is not None:
        timer = threading.Timer(DELAY, bar.show)
        timer.daemon = True
        timer.start()
    try:
        if stages is None:
            yield bar.advance if bar else _ignore
        else:
            with stages.stage(name):
                yield bar.advance if bar else _ignore
    finally:
        if timer is not None and bar is not None:
            timer.cancel()
            bar.close()


def peak_memory() -> int:
    """Bytes of memory that this process held at its peak (resident set), or 0 where the system does not tell.

    On Linux the peak since the last `Stages` was entered, elsewhere since the process started.
    """
    try:
        import resource
    except ImportError:  # Windows
        return 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


def _ignore(_: float) -> None:
    pass


def _wanted(stream: TextIO) -> bool:
    forced = os.environ.get("FREP_PROGRESS")
    if forced in ("0", "1"):
        return forced == "1"
    return stream.isatty()


class _Bar:
    """One bar of the shared display: silent until `show`."""

    def __init__(self, name: str, total: float | None) -> None:
        self.name = name
        self.total = total
        self.done = 0.0
        self.task = None
        self.closed = False

    def show(self) -> None:
        with _display.lock:
            if not self.closed:
                self.task = _display.add(self)

    def advance(self, amount: float) -> None:
        with _display.lock:
            self.done += amount
            if self.task is not None and _display.screen is not None:
                _display.screen.update(self.task, completed=self.done)

    def close(self) -> None:
        with _display.lock:
            self.closed = True
            if self.task is not None:
                _display.remove(self.task)
                self.task = None


class _Display:
    """The one live region that all bars share: a terminal has only one bottom line to redraw."""

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.screen: Progress | None = None

    def add(self, bar: _Bar):
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            Progress,
            TaskProgressColumn,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        if self.screen is None:
            self.screen = Progress(
                TextColumn("{task.description:<12}"),
                BarColumn(),
                TaskProgressColumn(),
                TimeElapsedColumn(),
                TimeRemainingColumn(),
                console=Console(stderr=True, force_terminal=True),
                transient=True,
                # What is printed meanwhile goes above the bar; but a stdout that leads to a file stays stdout.
                redirect_stdout=sys.stdout.isatty(),
            )
            self.screen.start()
        return self.screen.add_task(bar.name, total=bar.total, completed=int(bar.done))

    def remove(self, task) -> None:
        if self.screen is None:
            return
        self.screen.remove_task(task)
        if not self.screen.tasks:
            self.screen.stop()
            self.screen = None


_display = _Display()
