"""Writes `catalogue_table.py`, what is known of each entry, anew: `python -m topologies.catalogue_written`, a minute.

Needed after a change of a topology or of how facts are found; the tests of the catalogue say when.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any

from frep.catalogue import Entry
from frep.io.atomic import replacing

from .catalogue import ENTRIES


def table(entries: Iterable[Entry]) -> str:
    """The text of `catalogue_table.py`: what is found out of each entry, in six digits, fractions in four decimals."""

    def told(value: Any) -> str:
        if isinstance(value, float):
            return f"{value:.6g}" if value % 1.0 else f"{value:.1f}"
        if isinstance(value, tuple):
            return f"({', '.join(map(told, value))}{',' * (len(value) == 1)})"
        return json.dumps(value) if isinstance(value, str) else repr(value)

    rows = [
        '"""What is known of each entry of the catalogue, found out by `python -m topologies.catalogue_written`."""',
        "",
        "from __future__ import annotations",
        "",
        "from frep.catalogue import Facts, Known",
        "",
        "# fmt: off",
        "KNOWN = {",
    ]
    for entry in entries:
        found = entry.found_out()
        facts = [(f.name, getattr(found.facts, f.name)) for f in fields(found.facts)]
        said = ", ".join(f"{name}={told(value)}" for name, value in facts if value is not None)
        what = (found.forms, found.complement_congruent, found.valences, found.period)
        rows += [f"    {told(entry.name)}: Known(", f"        {', '.join(map(told, what))},"]
        rows += [f"        Facts({said}),", "        {"]
        for form, shares in found.fractions.items():
            rounded = tuple(None if s is None else round(s, 4) + 0.0 for s in shares)
            rows.append(f"            {told(form)}: {told(rounded)},")
        rows += ["        },", "    ),"]
    return "\n".join([*rows, "}", ""])


if __name__ == "__main__":
    with replacing(Path(__file__).with_name("catalogue_table.py")) as temporary:
        temporary.write_text(table(ENTRIES), encoding="utf-8")
