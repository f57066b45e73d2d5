"""The README's scripts run as they stand, where they need no file of the user's."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import frep

README = Path(__file__).parents[1] / "README.md"
BLOCKS = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)


@pytest.mark.parametrize(
    "block", [b for b in BLOCKS if b.lstrip().startswith("from ")], ids=lambda b: b.split("\n")[0][:40]
)
def test_scripts_of_the_readme_run(block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {"frep": __import__("frep")}
    exec(compile(block, "README.md", "exec"), names)
    written = list(tmp_path.iterdir())  # what it says it saves
    assert written
    assert all(frep.Mesh.load(path).check().printable for path in written)
