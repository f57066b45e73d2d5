"""Design files: a Python script that defines `part` or `lattice`, run with some of its parameters replaced.

A *parameter* is a name to which the script assigns, at its top level, a literal (`cell = 10`, `body = "airplane.ply"`) or a
declaration with a range and a unit (`twist = frep.parameter(0.3, 0, 1, "rad")`). Its value is replaced in the script's syntax
tree before anything runs, so everything the script derives from it follows.
"""

from __future__ import annotations

import ast
import math
import operator
import os
import sys
import traceback
import types
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frep.errors import ArgumentError, ArgumentTypeError, FileError, FrepError, FunctionError
from frep.parameter import Parameter, Value

if TYPE_CHECKING:
    from frep.solid import Solid


@dataclass(frozen=True)
class Design:
    """A design file that has been run.

    Attributes:
        path: the script.
        part: the solid that it defines, or that of its lattice.
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
        ArgumentError: a declaration that makes no sense, see `declared_parameters`.
    """
    return {declared.name: declared.default for declared in declared_parameters(path)}


def declared_parameters(path: str | os.PathLike[str]) -> list[Parameter]:
    """The parameters of a design file with their ranges and units, in the order of the script, which is not run.

    Raises:
        FileError: no such file, or not text.
        FunctionError: not Python; the SyntaxError is its cause.
        ArgumentError: a call of `frep.parameter` whose arguments are not written out, or whose default is out of range.
    """
    path = Path(path)
    return [slot.parameter for slot in _declared(_parsed(path), path).values()]


def load_design(path: str | os.PathLike[str], replaced: Mapping[str, str] | None = None) -> Design:
    """Run a design file.

    Args:
        path: the script; it must define `part`, a Solid, or `lattice`, something with a method `solid()` that gives one.
        replaced: new values of some of its parameters, as text; each is read as the type of the parameter's default.

    Raises:
        FileError: no such file, or not text.
        ArgumentError: an undeclared parameter, or a value that does not fit or is out of range; or the script defines
            neither `part` nor `lattice`.
        ArgumentTypeError: `part` is not a Solid.
        FunctionError: the script itself failed; the original exception is its cause. A FrepError passes through.
    """
    path = Path(path)
    names = run_script(path, replaced)
    from frep.solid import Solid

    if "part" in names:
        part, source = names["part"], "`part`"
    elif callable(getattr(names.get("lattice"), "solid", None)):
        part, source = names["lattice"].solid(), "`lattice.solid()`"
    else:
        raise ArgumentError(
            f"design: {path} defines no `part`; a design file ends with part = <a Solid>, or lattice = <a lattice>"
        )
    if not isinstance(part, Solid):
        raise ArgumentTypeError(f"design: {source} in {path} must be a Solid, got {type(part).__name__}")
    return Design(path, part, names)


def run_script(path: str | os.PathLike[str], replaced: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Run a script with some of its parameters replaced.

    Args:
        path: the script.
        replaced: new values of some of its parameters, as text.

    Returns:
        Everything that it defines at its top level, by name.

    Raises:
        FileError, ArgumentError, FunctionError: as for `load_design`.
    """
    path = Path(path)
    tree = _parsed(path)
    declared = _declared(tree, path)
    for name, text in (replaced or {}).items():
        if name not in declared:
            known = ", ".join(f"{key}={slot.parameter.default!r}" for key, slot in declared.items()) or "none"
            raise ArgumentError(f"param: {path.name} declares no parameter {name!r}; it declares: {known}")
        declared[name].replace(text)

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
    return {key: value for key, value in vars(module).items() if not key.startswith("__")}


def _in_script(frame: types.FrameType, path: Path) -> bool:
    return frame.f_code.co_filename == os.fspath(path)


def _parsed(path: Path) -> ast.Module:
    from frep.io.read import READABLE_SUFFIXES

    try:
        source = path.read_bytes()
    except OSError as error:
        raise FileError(f"design: cannot read {str(path)!r}: {error.strerror or error}") from error
    # Their first bytes would make a syntax error that tells nobody what is wrong.
    if path.suffix.lower() in READABLE_SUFFIXES:
        raise FileError(
            f"design: {str(path)!r} is a mesh file by its suffix, not a Python script; `frep info`, `frep check` and "
            "`frep render` take it, and in a script frep.load"
        )
    if b"\0" in source:
        raise FileError(f"design: {str(path)!r} is not text, but a Python script was expected")
    try:
        return ast.parse(source, os.fspath(path))
    except (SyntaxError, ValueError) as error:
        raise FunctionError(f"design: {path} is not Python: {error}") from error


@dataclass(frozen=True)
class _Slot:
    """A parameter, and the place in the syntax tree where its value stands."""

    parameter: Parameter
    declared: bool  # by a call of frep.parameter; what a script merely assigns may be anything
    put: Callable[[ast.expr], None]

    def replace(self, text: str) -> None:
        """Write the value that a text says into the tree; refuse what does not fit."""
        name, default = self.parameter.name, self.parameter.default
        value: Any = _converted(name, text, default)
        if self.declared:
            self.parameter.check(value, "param: ")
        self.put(ast.Constant(value))


def _declared(tree: ast.Module, path: Path) -> dict[str, _Slot]:
    """The parameters of a script by name: the first assignment to each name counts."""
    found: dict[str, _Slot] = {}
    callees = _callees(tree)
    for node in tree.body:
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            target = node.targets[0]
        elif isinstance(node, ast.AnnAssign) and node.value is not None:
            target = node.target
        else:
            continue
        if not isinstance(target, ast.Name) or target.id in found or node.value is None:
            continue
        if isinstance(node.value, ast.Call) and ast.unparse(node.value.func) in callees:
            try:
                found[target.id] = _called(target.id, node.value)
            except FrepError as error:
                error.add_note(f"{path}, line {node.lineno}")
                raise
            continue
        try:
            value = ast.literal_eval(node.value)
        except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
            continue
        if isinstance(value, bool | int | float | str | tuple):
            found[target.id] = _Slot(Parameter(target.id, value), False, _setter(node))
    return found


def _callees(tree: ast.Module) -> set[str]:
    """What the script calls `frep.parameter`: as it imports it."""
    found = set()
    for node in tree.body:
        if isinstance(node, ast.Import):
            found |= {f"{alias.asname or alias.name}.parameter" for alias in node.names if alias.name == "frep"}
        elif isinstance(node, ast.ImportFrom) and node.module == "frep" and not node.level:
            found |= {alias.asname or alias.name for alias in node.names if alias.name == "parameter"}
    return found


def _called(name: str, call: ast.Call) -> _Slot:
    """The parameter that a call of `frep.parameter` declares."""
    fields = ("default", "low", "high", "unit", "help")
    written: dict[str | None, ast.expr] = dict(zip(fields, call.args, strict=False))
    written |= {keyword.arg: keyword.value for keyword in call.keywords}
    if len(call.args) > len(fields) or len(written) < len(call.args) + len(call.keywords) or "default" not in written:
        raise ArgumentError(f"parameter: {name}: expected parameter({', '.join(fields)}), each once, default at least")
    values: dict[str, Any] = {}
    for key, node in written.items():
        if key not in fields:
            raise ArgumentError(
                f"parameter: {name}: unknown argument {ast.unparse(node)!r}; known: {', '.join(fields)}"
            )
        try:
            values[key] = _constant(node)
        except (ValueError, TypeError, ArithmeticError) as error:
            raise ArgumentError(
                f"parameter: {name}: {key} must be written out (numbers, text, math.pi, arithmetic), so that parameters can be "
                f"listed without running the script; got {ast.unparse(node)}"
            ) from error
    declared = Parameter(name, **values)
    try:
        declared.validate()
    except FrepError as error:
        raise type(error)(f"parameter: {error}") from None

    def put(value: ast.expr) -> None:
        value = ast.copy_location(value, call)
        if call.args:
            call.args[0] = value
        else:
            next(keyword for keyword in call.keywords if keyword.arg == "default").value = value

    return _Slot(declared, True, put)


def _setter(node: ast.Assign | ast.AnnAssign) -> Callable[[ast.expr], None]:
    def put(value: ast.expr) -> None:
        node.value = ast.copy_location(value, node)

    return put


_ARITHMETIC: dict[type, Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}


def _constant(node: ast.expr) -> Any:
    """The value of an expression of literals, `math.pi` (numpy's too) and arithmetic; ValueError where it is none."""
    if isinstance(node, ast.BinOp) and type(node.op) in _ARITHMETIC:
        return _ARITHMETIC[type(node.op)](_constant(node.left), _constant(node.right))
    if isinstance(node, ast.UnaryOp) and type(node.op) in _ARITHMETIC:
        return _ARITHMETIC[type(node.op)](_constant(node.operand))
    if isinstance(node, ast.Tuple):
        return tuple(_constant(part) for part in node.elts)
    if isinstance(node, ast.Attribute) and ast.unparse(node) in ("math.pi", "math.tau", "np.pi", "numpy.pi"):
        return getattr(math, node.attr)
    return ast.literal_eval(node)


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
