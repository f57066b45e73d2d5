"""Design files: a Python script that defines `part`, run with some of its parameters replaced.

A *parameter* is a name to which the script assigns a literal at its top level (`cell = 10`, `body = "airplane.ply"`).
Its value is replaced in the script's syntax tree before anything runs, so everything the script derives from it follows.
"""

from __future__ import annotations

import ast
import os
import sys
import traceback
import types
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frep.errors import ArgumentError, ArgumentTypeError, FileError, FrepError, FunctionError

if TYPE_CHECKING:
    from frep.solid import Solid

Value = int | float | str | bool | tuple[Any, ...]
"""What a parameter can be."""


@dataclass(frozen=True)
class Design:
    """A design file that has been run.

    Attributes:
        path: the script.
        part: the solid that it defines.
        names: everything that it defines at its top level.
    """

    path: Path
    part: Solid
    names: Mapping[str, Any]

    @property
    def title(self) -> str:
        """The script's `title`, or its file name."""
        title = self.names.get("title")
        return title if isinstance(title, str) else self.path.stem


def parameters(path: str | os.PathLike[str]) -> dict[str, Value]:
    """The parameters that a design file declares, with their default values; the script is not run.

    Raises:
        FileError: no such file, or not text.
        FunctionError: not Python; the SyntaxError is its cause.
    """
    return {name: value for name, (_, value) in _declared(_parsed(Path(path))).items()}


def load_design(path: str | os.PathLike[str], replaced: Mapping[str, str] | None = None) -> Design:
    """Run a design file.

    Args:
        path: the script; it must define `part`, a Solid.
        replaced: new values of some of its parameters, as text; each is read as the type of the parameter's default.

    Raises:
        FileError: no such file, or not text.
        ArgumentError: an undeclared parameter, or a value that does not fit; or the script defines no `part`.
        ArgumentTypeError: `part` is not a Solid.
        FunctionError: the script itself failed; the original exception is its cause. A FrepError passes through.
    """
    path = Path(path)
    tree = _parsed(path)
    declared = _declared(tree)
    for name, text in (replaced or {}).items():
        if name not in declared:
            known = ", ".join(f"{key}={value!r}" for key, (_, value) in declared.items()) or "none"
            raise ArgumentError(f"param: {path.name} declares no parameter {name!r}; it declares: {known}")
        node, default = declared[name]
        constant: Any = _converted(name, text, default)
        node.value = ast.fix_missing_locations(ast.Constant(constant))

    # A name other than __main__: what a script does for itself when run alone, it does not do here.
    module = types.ModuleType("frep_design")
    module.__file__ = os.fspath(path)
    sys.modules[module.__name__] = module
    sys.path.insert(0, os.fspath(path.resolve().parent))
    try:
        exec(compile(tree, os.fspath(path), "exec"), module.__dict__)
    except FrepError as error:
        lines = [line for frame, line in traceback.walk_tb(error.__traceback__) if _in_script(frame, path)]
        if lines:
            error.add_note(f"{path}, line {lines[-1]}")
        raise
    except Exception as error:
        raise FunctionError(f"{path}: the script raised {type(error).__name__}: {error}") from error
    finally:
        sys.path.remove(os.fspath(path.resolve().parent))

    names = {key: value for key, value in vars(module).items() if not key.startswith("__")}
    if "part" not in names:
        raise ArgumentError(f"design: {path} defines no `part`; a design file ends with part = <a Solid>")
    from frep.solid import Solid

    if not isinstance(names["part"], Solid):
        raise ArgumentTypeError(f"design: `part` in {path} must be a Solid, got {type(names['part']).__name__}")
    return Design(path, names["part"], names)


def _in_script(frame: types.FrameType, path: Path) -> bool:
    return frame.f_code.co_filename == os.fspath(path)


def _parsed(path: Path) -> ast.Module:
    try:
        source = path.read_bytes()
    except OSError as error:
        raise FileError(f"design: cannot read {str(path)!r}: {error.strerror or error}") from error
    try:
        return ast.parse(source, os.fspath(path))
    except (SyntaxError, ValueError) as error:  # ValueError: null bytes
        raise FunctionError(f"design: {path} is not Python: {error}") from error


def _declared(tree: ast.Module) -> dict[str, tuple[ast.Assign | ast.AnnAssign, Value]]:
    found: dict[str, tuple[ast.Assign | ast.AnnAssign, Value]] = {}
    for node in tree.body:
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            target = node.targets[0]
        elif isinstance(node, ast.AnnAssign) and node.value is not None:
            target = node.target
        else:
            continue
        if not isinstance(target, ast.Name) or target.id in found or node.value is None:
            continue
        try:
            value = ast.literal_eval(node.value)
        except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
            continue
        if isinstance(value, bool | int | float | str | tuple):
            found[target.id] = (node, value)
    return found


def _converted(name: str, text: str, default: Value) -> Value:
    def refused(accepted: str) -> ArgumentError:
        return ArgumentError(f"param: {name}={text!r} does not fit its default {default!r}; expected {accepted}")

    if isinstance(default, str):
        return text
    if isinstance(default, bool):
        word = text.strip().lower()
        if word not in ("true", "yes", "on", "1", "false", "no", "off", "0"):
            raise refused("true or false")
        return word in ("true", "yes", "on", "1")
    if isinstance(default, tuple):
        try:
            value = ast.literal_eval(text.strip())
        except (ValueError, TypeError, SyntaxError) as error:
            raise refused(f"{len(default)} values with commas between them") from error
        value = tuple(value) if isinstance(value, list | tuple) else (value,)
        if len(value) != len(default):
            raise refused(f"{len(default)} values with commas between them")
        return value
    if isinstance(default, int):
        try:
            return int(text)
        except ValueError:
            pass  # `cell = 10` is 10 mm, and 7.5 is as good a cell
    try:
        return float(text)
    except ValueError as error:
        raise refused("a number") from error
