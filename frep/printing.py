"""Fields as readable text: Python that builds the same Field again, but for digits and very long ones."""

from __future__ import annotations

from .field import Field, topological

_LEVEL = {"less": 1, "less_equal": 1, "add": 2, "subtract": 2, "multiply": 3, "divide": 3, "negative": 4, "square": 5}
_ATOM = 9
_SYMBOL = {"add": " + ", "subtract": " - ", "multiply": "*", "divide": "/", "less": " < ", "less_equal": " <= "}
_NAME = {"absolute": "abs"}
_LIMIT = 2000


def expression_text(field: Field) -> str:
    """Python-like text of an expression; very long ones are cut in the middle."""
    text: dict[Field, tuple[str, int]] = {}
    for node in topological([field]):
        text[node] = _node_text(node, [text[a] for a in node.args])
    whole = text[field][0]
    if len(whole) > _LIMIT:
        return f"{whole[: _LIMIT // 2]} ... {whole[-_LIMIT // 4 :]}"
    return whole


def _node_text(node: Field, args: list[tuple[str, int]]) -> tuple[str, int]:
    match node.op:
        case "coordinate":
            return "xyz"[node.data], _ATOM
        case "constant":
            return f"{node.data:.12g}", _ATOM if node.data >= 0 else 4
        case "negative":
            return f"-{_wrap(args[0], 4)}", 4
        case "square":
            return f"{_wrap(args[0], 6)}**2", 5
        case op if op in _SYMBOL:
            level = _LEVEL[op]
            # Python groups sums and products from the left, and would chain comparisons.
            left = level + (op in ("less", "less_equal"))
            return f"{_wrap(args[0], left)}{_SYMBOL[op]}{_wrap(args[1], level + 1)}", level
        case op:
            name = node.data.name if node.data is not None else _NAME.get(op, op)
            inner = ", ".join(_shorten(a[0]) for a in args)
            return f"{name}({inner})", _ATOM


def _wrap(part: tuple[str, int], level: int) -> str:
    text = _shorten(part[0])
    return text if part[1] >= level else f"({text})"


def _shorten(text: str) -> str:
    # Shared subexpressions can make the text exponentially long; the graph itself is not.
    return text if len(text) <= 2 * _LIMIT else f"{text[:_LIMIT]} ... {text[-_LIMIT // 2 :]}"
