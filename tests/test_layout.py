"""The house keeps its plan: who may import whom, no circles, and the README's commands exist."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("frep", "topologies", "graded", "conformal", "gallery", "tests", "benchmarks")
MAY_IMPORT = {
    "frep": {"frep"},
    "topologies": {"topologies", "frep"},
    "graded": {"graded", "frep"},
    "conformal": {"conformal", "frep"},
    "gallery": {"gallery", "frep", "topologies", "graded", "conformal"},
}


def modules() -> dict[str, Path]:
    """Every module of the wheel by its dotted name."""
    found = {}
    for folder in MAY_IMPORT:
        for path in sorted((ROOT / folder).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


MODULES = modules()


def imports(name: str, *, everywhere: bool) -> set[str]:
    """Dotted names that a module imports: anywhere in its text, or only what runs when it is itself imported."""
    path = MODULES[name]
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    found: set[str] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                above = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*above, base] if base else above)
            found.add(base)
            found.update(f"{base}.{alias.name}" for alias in node.names)
        elif not everywhere and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            return
        elif not everywhere and isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            for child in node.orelse:
                visit(child)
            return
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(ast.parse(path.read_text()))
    return found


def test_the_modules_are_found():
    """The laws below say nothing about a list that is empty."""
    assert {"frep", "frep.errors", "frep.cli", "gallery", "topologies", "graded"} <= set(MODULES)
    assert imports("frep.cli", everywhere=True) > imports("frep.cli", everywhere=False) > {"frep.errors"}


@pytest.mark.parametrize("folder", MAY_IMPORT)
def test_folders_import_only_downwards(folder):
    ours = set(FOLDERS)
    for name in MODULES:
        if name.split(".")[0] == folder:
            up = {
                target for target in imports(name, everywhere=True) if target.split(".")[0] in ours - MAY_IMPORT[folder]
            }
            assert not up, f"{name} imports {sorted(up)}"


def test_no_import_circles():
    """Counting what runs at import; that a package's `__init__` runs before its modules makes no circle."""
    edges = {}
    for name in MODULES:
        edges[name] = {target for target in imports(name, everywhere=False) if target in MODULES and target != name}
        # `from frep.x import y` also names frep.x.y; a package named on the way to a module is not a dependency.
        edges[name] -= {package for package in edges[name] if any(t.startswith(package + ".") for t in edges[name])}
        edges[name] -= {name.rpartition(".")[0]}
    done: set[str] = set()

    def walk(name: str, trail: tuple[str, ...]) -> None:
        assert name not in trail, "import circle: " + " -> ".join([*trail[trail.index(name) :], name])
        if name not in done:
            for target in sorted(edges[name]):
                walk(target, (*trail, name))
            done.add(name)

    for name in edges:
        walk(name, ())


def test_design_files_are_short():
    """A gallery script is read before it is run: two dozen lines at most."""
    for path in (ROOT / "gallery").glob("*.py"):
        if not path.name.startswith("_") and "part =" in path.read_text():
            code = [
                line for line in path.read_text().splitlines() if line.strip() and not line.lstrip().startswith("#")
            ]
            assert len(code) <= 24, f"{path.name} has {len(code)} lines"


def readme() -> str:
    return (ROOT / "README.md").read_text()


def test_readme_make_targets_exist():
    targets = set(re.findall(r"^([a-z][a-z-]*):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = set(re.findall(r"\bmake ([a-z]+)", " ".join(code_of(readme()))))
    assert {"demo", "test"} <= named <= targets


def test_readme_commands_exist():
    from frep.cli import app

    named = set(re.findall(r"\bfrep ([a-z]+) +\S+\.(?:py|stl|ply|obj)", " ".join(code_of(readme()))))
    assert named
    known = {name for name in app if not name.startswith("-")}
    assert named <= known


def test_readme_files_exist():
    links = {link for link in re.findall(r"\]\(([^)#]+)\)", readme()) if "://" not in link}
    assert links
    assert not {link for link in links if not (ROOT / link).exists()}


def code_of(markdown: str) -> list[str]:
    """Code blocks and inline code."""
    blocks = re.findall(r"```.*?\n(.*?)```", markdown, re.DOTALL)
    return blocks + re.findall(r"`([^`\n]+)`", re.sub(r"```.*?```", "", markdown, flags=re.DOTALL))
