"""The sizes of the code base at some revisions, side by side, as a Markdown table.

    python -m pipelines.experiments.house [REVISION ...]

A package is a folder of `shiplog`; a room is a folder in it, or a module that stands in the package
itself. An arrow goes from a room to another one of its package that it imports; the levels are the
rooms of the longest chain of arrows. Functions include methods and functions in functions. A
docstring has a formula where one of its lines relates two things by = ~ ≈ ← ∝ ≤ ≥ between spaces,
or holds one of Σ Π ∫ √ ∂ ᵀ ½ ⁻¹, argmin or argmax. HEAD unless revisions are given.
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import subprocess
import tarfile
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

FORMULA = re.compile(r"\S +[=~≈←∝≤≥] +\S|[ΣΠ∫√∂ᵀ½]|⁻¹|\bargm(in|ax)\b")
LONG = 60  # lines, above which a function usually holds two ideas
FOLDERS = ("shiplog", "pipelines", "tests")
Function = tuple[
    str, ast.FunctionDef | ast.AsyncFunctionDef, bool
]  # module, itself, not in another
Graph = dict[str, set[str]]


def modules_of(root: Path) -> dict[str, str]:
    """Dotted name → text of every Python file below FOLDERS."""
    paths = [p for folder in FOLDERS for p in sorted((root / folder).rglob("*.py"))]
    dotted = (".".join(p.relative_to(root).with_suffix("").parts) for p in paths)
    texts = (path.read_text(encoding="utf-8") for path in paths)
    return {n.removesuffix(".__init__"): text for n, text in zip(dotted, texts, strict=True)}


def imports(tree: ast.Module, modules: dict[str, str]) -> Iterator[str]:
    """Modules that a module imports, anywhere in it; `from a import b` is a.b where that is one."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif isinstance(node, ast.ImportFrom) and node.module in modules:
            inner = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from (name if name in modules else node.module for name in inner)


def arrows(graph: Graph, package: str) -> Graph:
    """Room → rooms of the same package that it imports, of all modules' imports."""
    inside, found = f"shiplog.{package}.", dict[str, set[str]]()
    for module in (m for m in graph if m.startswith(inside)):
        room, *_ = module.removeprefix(inside).split(".")
        there = {
            m.removeprefix(inside).split(".")[0] for m in graph[module] if m.startswith(inside)
        }
        found.setdefault(room, set()).update(there - {room})
    return found


def levels(graph: Graph) -> int:
    """Rooms of the longest chain of arrows; an arrow that closes a circle is not followed."""
    known: dict[str, int] = {}

    def depth(room: str, above: frozenset[str]) -> int:
        if room not in known:
            below = (depth(r, above | {r}) for r in sorted(graph[room] - above))
            known[room] = 1 + max(below, default=0)
        return known[room]

    return max((depth(room, frozenset((room,))) for room in sorted(graph)), default=0)


def length(function: Function) -> int:
    return (function[1].end_lineno or 0) - function[1].lineno + 1


def has_formula(docstring: str) -> bool:
    """Whether a line of it is, or holds, a formula as the module says."""
    return any(FORMULA.search(line) for line in docstring.splitlines())


def with_formula(functions: list[Function]) -> int:
    return sum(has_formula(ast.get_docstring(node) or "") for _, node, _ in functions)


def rows(root: Path) -> dict[str, str]:
    """What is counted in a tree → its number. Raises SyntaxError for a module that is none."""
    modules = modules_of(root)
    lines = {m: len(text.splitlines()) for m, text in modules.items()}
    trees = {m: ast.parse(t) for m, t in modules.items() if m.startswith("shiplog")}
    functions: list[Function] = [
        (m, node, node in tree.body) for m, tree in trees.items() for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]  # fmt: skip
    longest, most = max(trees, key=lambda m: lines[m]), max(functions, key=length)
    public = {(m, f.name) for m, f, outer in functions if outer and not f.name.startswith("_")}
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found = {"files": len(trees)}
    found |= {f"lines of {f}": sum(n for m, n in lines.items() if m.startswith(f)) for f in FOLDERS}
    found |= {
        "longest file": f"{lines[longest]} ({longest.removeprefix('shiplog.')})",
        "longest function": f"{length(most)} ({most[1].name})",
        f"functions over {LONG} lines": sum(length(f) > LONG for f in functions),
        "functions": len(functions),
        "functions with a docstring": sum(bool(ast.get_docstring(f)) for _, f, _ in functions),
        "functions with a formula": with_formula(functions),
        "names that are public functions of several modules":
            sum(n > 1 for n in Counter(name for _, name in public).values()),
        "dependencies": len(project.get("dependencies", ())),
    }  # fmt: skip
    graph = {m: {*imports(tree, modules)} - {m} for m, tree in trees.items()}
    for package in sorted({m.split(".")[1] for m in trees if m.count(".") > 1}):
        rooms = arrows(graph, package)
        own = [f for f in functions if f[0].startswith(f"shiplog.{package}.")]
        found[f"{package}: rooms, arrows, levels; functions, with a formula"] = (
            f"{len(rooms)}, {sum(map(len, rooms.values()))}, {levels(rooms)}; "
            f"{len(own)}, {with_formula(own)}"
        )
    return {name: f"{number}" for name, number in found.items()}


def at_revision(revision: str) -> dict[str, str]:
    """`rows` of a revision of this repository, unpacked in a temporary folder."""
    command = ["git", "archive", revision, *FOLDERS, "pyproject.toml"]
    packed = subprocess.run(
        command, cwd=Path(__file__).parents[2], stdout=subprocess.PIPE, check=True
    ).stdout
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
            archive.extractall(folder, filter="data")
        return rows(Path(folder))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("revisions", nargs="*", default=["HEAD"], metavar="REVISION")
    columns = {revision: at_revision(revision) for revision in parser.parse_args().revisions}
    print(f"| | {' | '.join(columns)} |\n|---|{'---:|' * len(columns)}")
    for name in dict.fromkeys(name for column in columns.values() for name in column):
        print(f"| {name} | {' | '.join(c.get(name, '-') for c in columns.values())} |")


if __name__ == "__main__":
    main()
