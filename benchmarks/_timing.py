"""What the benchmarks share: contestants that take turns, medians, tables, and child processes with their peak memory.

Nothing here asserts: a benchmark states what it measured, the ratio, and the figure to reach.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

RUNS = 5


@dataclass
class Times:
    """Seconds of each counted run, and what the last run was said to have made."""

    seconds: list[float] = field(default_factory=list)
    facts: Any = None

    @property
    def median(self) -> float:
        return statistics.median(self.seconds)


def options(description: str | None, **extra: tuple[Any, str]) -> argparse.Namespace:
    """The command line: `--runs`, and one option of a default and a help text for each keyword."""
    parser = argparse.ArgumentParser(description=(description or "").split("\n")[0])
    parser.add_argument("--runs", type=int, default=RUNS, help="counted runs of each contestant")
    for name, (default, text) in extra.items():
        flag = f"--{name.replace('_', '-')}"
        if default is False:
            parser.add_argument(flag, action="store_true", help=text)
        else:
            parser.add_argument(flag, type=type(default), default=default, help=text)
    return parser.parse_args()


def alternate(
    contestants: Mapping[str, Callable[[], Any]], runs: int, describe: Callable[[Any], Any] = lambda made: made
) -> dict[str, Times]:
    """Run the contestants in turn, so that a slow minute of the machine meets them all; the first round, which compiles
    and loads, is not counted. What a run makes is described outside its time and dropped before the next begins."""
    times = {name: Times() for name in contestants}
    for turn in range(runs + 1):
        for name, run in contestants.items():
            gc.collect()
            start = time.perf_counter()
            made = run()
            elapsed = time.perf_counter() - start
            if turn > 0:
                times[name].seconds.append(elapsed)
            times[name].facts = describe(made)
            del made
    return times


def table(heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Print rows in columns: the first to the left, the others to the right."""
    cells = [list(heads), *[["" if c is None else str(c) for c in row] for row in rows]]
    widths = [max(len(row[i]) for row in cells) for i in range(len(heads))]
    for row in cells:
        line = [row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))]
        print("  ".join(line).rstrip())


def print_times(times: Mapping[str, Times], fact: str = "triangles") -> None:
    """A line a contestant: median, range, what it made."""
    table(
        ["", "median s", "least", "most", fact],
        [
            [name, f"{t.median:.3f}", f"{min(t.seconds):.3f}", f"{max(t.seconds):.3f}", f"{t.facts:,}"]
            for name, t in times.items()
        ],
    )


def print_ratio(what: str, value: float, reach: str, unit: str = "") -> None:
    """A line with a ratio and the figure to reach."""
    print(f"{what:<58s} {value:8.3g}{unit:<3s} reach {reach}")


def setting(runs: int, *more: str) -> str:
    """One line: threads, runs, and how busy the machine is with other work."""
    import numba

    load = f"load {os.getloadavg()[0]:.1f} at the start" if hasattr(os, "getloadavg") else ""
    return ", ".join([*more, f"{numba.get_num_threads()} threads", f"median of {runs}", "warm cache", load])


# --- processes of their own --------------------------------------------------------------------------------------------


def peak_bytes() -> int:
    """The most memory this process has held so far.

    `VmHWM` where there is one: `ru_maxrss` of a fresh process begins with what its parent held when it forked.
    """
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    scale = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * scale


def child(command: Sequence[str], env: Mapping[str, str] | None = None, limit: float = 1800.0) -> dict[str, Any]:
    """Run a process whose last line of output is a JSON object; that object, with the whole process's `wall` seconds.

    Raises:
        RuntimeError: the process failed, with the end of what it said.
    """
    start = time.perf_counter()
    try:
        done = subprocess.run(
            command, env={**os.environ, **(env or {})}, capture_output=True, text=True, timeout=limit, check=False
        )
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"longer than {limit:g} s") from None
    wall = time.perf_counter() - start
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines()
        reason = said[-1] if said else f"signal {-done.returncode}" if done.returncode < 0 else "no output"
        raise RuntimeError(f"exit {done.returncode}: {reason}")
    return {**json.loads(done.stdout.strip().splitlines()[-1]), "wall": wall}


def this_script(*arguments: str) -> list[str]:
    """The command that runs the calling script again, with other arguments."""
    return [sys.executable, sys.argv[0], *arguments]


def report(**facts: Any) -> None:
    """What a child process says: its last line."""
    print(json.dumps(facts), flush=True)
