"""A bar only where somebody looks and only for long work; stages that add up."""

from __future__ import annotations

import io
import sys
import threading
import time

import pytest

import frep.progress
from frep.progress import Stages, closing_table, peak_memory, progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def look(monkeypatch) -> Terminal:
    """stderr as a terminal that keeps what is drawn on it. No fixture: pytest's capture sets stderr anew for the test."""
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.delenv("FREP_PROGRESS", raising=False)
    return terminal


def wait_for(condition) -> None:
    until = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.01)


def test_short_work_shows_nothing(monkeypatch):
    screen = look(monkeypatch)
    with progress("meshing", total=10) as advance:
        for _ in range(10):
            advance(1)
    assert screen.getvalue() == ""


def test_long_work_shows_its_name_and_how_far_it_is(monkeypatch):
    screen = look(monkeypatch)
    monkeypatch.setattr(frep.progress, "DELAY", 0.01)
    with progress("meshing", total=8) as advance:
        advance(2)
        wait_for(lambda: "meshing" in screen.getvalue())
        assert "25%" in screen.getvalue()
        advance(4)
        wait_for(lambda: "75%" in screen.getvalue())
    assert frep.progress._display.screen is None


def test_bars_share_the_screen_and_leave_it(monkeypatch):
    screen = look(monkeypatch)
    monkeypatch.setattr(frep.progress, "DELAY", 0.01)
    with progress("outer"), progress("inner", total=2) as advance:
        threads = [threading.Thread(target=advance, args=(1,)) for _ in range(2)]
        for thread in threads:
            thread.start()
        wait_for(lambda: "outer" in screen.getvalue() and "100%" in screen.getvalue())
        for thread in threads:
            thread.join()
    assert frep.progress._display.screen is None
    after = screen.getvalue()
    with progress("later"):
        pass
    assert screen.getvalue() == after


def test_a_failure_takes_the_bar_away(monkeypatch):
    screen = look(monkeypatch)
    monkeypatch.setattr(frep.progress, "DELAY", 0.01)
    with pytest.raises(KeyboardInterrupt), progress("meshing"):
        wait_for(lambda: "meshing" in screen.getvalue())
        raise KeyboardInterrupt
    assert frep.progress._display.screen is None


@pytest.mark.parametrize(("forced", "terminal", "shown"), [("1", False, True), ("0", True, False), ("", False, False)])
def test_where_a_bar_is_shown(monkeypatch, forced, terminal, shown):
    stream = Terminal() if terminal else io.StringIO()
    monkeypatch.setenv("FREP_PROGRESS", forced)
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(frep.progress, "DELAY", 0.0)
    with progress("meshing"):
        if shown:
            wait_for(lambda: "meshing" in stream.getvalue())
        else:
            time.sleep(0.05)
    assert ("meshing" in stream.getvalue()) == shown


def test_stages_add_up_to_the_whole():
    start = time.perf_counter()
    with Stages() as stages:
        with progress("sampling"):
            with progress("meshing"):
                time.sleep(0.02)
            time.sleep(0.01)
        with progress("sampling"):
            pass
    whole = time.perf_counter() - start
    assert list(stages.seconds) == ["sampling", "meshing"]
    assert stages.seconds["meshing"] >= 0.02
    assert stages.seconds["sampling"] >= 0.01
    assert stages.total == pytest.approx(sum(stages.seconds.values()))
    assert 0.03 <= stages.total <= whole


def test_stages_end_where_their_block_ends():
    with Stages() as outer:
        with Stages() as inner, progress("a"):
            pass
        with progress("b"):
            pass
    with progress("c"):
        pass
    assert list(inner.seconds) == ["a"]
    assert list(outer.seconds) == ["b"]


def test_a_failed_stage_still_counts():
    with Stages() as stages, pytest.raises(ValueError, match="x"), progress("sampling"):
        time.sleep(0.01)
        raise ValueError("x")
    assert stages.seconds["sampling"] >= 0.01


def test_closing_table_tells_everything():
    stream = io.StringIO()
    stages = Stages()
    with stages, progress("sampling"):
        pass
    closing_table("A part", {"triangles": "1,234", "area, mm2": "5.6"}, stages, stream=stream)
    text = stream.getvalue()
    for word in ("A part", "triangles", "1,234", "area, mm2", "5.6", "sampling", "peak memory"):
        assert word in text


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux can forget an earlier peak")
def test_peak_memory_is_the_jobs_own():
    held = b"x" * 300_000_000
    before = peak_memory()
    assert before > len(held)
    del held
    with Stages():
        assert peak_memory() < before - 200_000_000
        held = b"x" * 150_000_000
        assert peak_memory() > len(held)
