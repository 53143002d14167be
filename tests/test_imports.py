"""Imports go one way; only the command line calls pipelines; MCAP and Rerun stay in their rooms."""

import ast
import graphlib
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROWS = (  # each may import its own row (a package its own modules) and the rows above
    {"exceptions", "channels", "seeds", "cache", "timescale", "parts"},
    {"units", "findings", "traced", "unexpected", "wind_histogram"},
    {"profile", "config", "logs", "comparison", "exhibit"},
    {"align", "midship", "quality", "conversion"},
    {"draft"},
    {"grid", "table", "parity", "parity_fit", "record", "variational"},
    {"ingest", "causes", "segments", "parity_campaign"},
    {"store", "windows", "correct"},
    {"models"},
    {"arguments", "user_causes"},
    {"training", "simulate", "coverage", "sensitivity"},
    {"identify", "band", "gain"},
    {
        "evaluate",
        "floors",
        "crossvalidation",
        "identifiability",
        "residual",
        "forces",
        "judgement",
    },
    {"linearise", "evidence", "wrong", "extend", "ridge"},
    {"unexplained", "structure", "conventions", "columns"},
    {"misfit", "reading"},
    {"reference"},
    {"unseen", "external", "hypotheses"},
    {"unnamed", "settling"},
    {"decision"},
    {"diagnosis"},
    {"advise", "earlier_runs", "remembered"},
    {"runs", "report", "viewer", "verdict", "page", "paper"},
    {"cli"},
)
LEVEL = {name: level for level, row in enumerate(ROWS) for name in row}
SOURCES = sorted((ROOT / "shiplog").rglob("*.py"))


def imported(path):
    """(line, full module name) of every import, wherever in the file it stands."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            module = node.module or ""
            yield node.lineno, module
            if module == "shiplog":
                yield from ((node.lineno, f"shiplog.{alias.name}") for alias in node.names)


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_go_one_way(path):
    room = path.relative_to(ROOT / "shiplog").parts[0].removesuffix(".py")
    if room == "__init__":
        return
    for line, module in imported(path):
        parts = module.split(".")
        where = f"{path.relative_to(ROOT)}:{line} imports {module}"
        if parts[0] == "pipelines":
            assert room == "cli", where
        if parts[0] == "shiplog" and len(parts) > 1 and parts[1] != room:
            assert LEVEL[parts[1]] <= LEVEL[room], where
        if parts[0] in ("mcap", "mcap_protobuf", "mcap_ros2"):
            assert room == "logs", where
        if parts[0] == "rerun":
            assert room in ("logs", "viewer"), where
        if parts[0] == "pickle":
            raise AssertionError(where)


def test_modules_of_the_diagnosis_have_no_circle():
    """What a module of it imports stands before it, in some order of them all."""
    room = ROOT / "shiplog" / "diagnosis"
    uses = {}
    for path in room.glob("*.py"):
        found = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            module = getattr(node, "module", None) or ""
            if isinstance(node, ast.ImportFrom) and module.startswith("shiplog.diagnosis"):
                of = [alias.name for alias in node.names] if module.endswith("diagnosis") else []
                found |= {module.split(".")[-1], *of} - {"diagnosis"}
        uses[path.stem] = found
    assert "trial" in uses["search"] and "thresholds" in uses["decide"]  # both ways of importing
    list(graphlib.TopologicalSorter(uses).static_order())  # raises CycleError


def test_every_room_has_a_level():
    rooms = {p.relative_to(ROOT / "shiplog").parts[0].removesuffix(".py") for p in SOURCES}
    assert rooms - {"__init__"} == set(LEVEL)


def test_commands_that_need_no_network_do_not_load_torch():
    """It costs seconds and 200 MB: ingest, check and voyages do without."""
    program = (
        "import sys, shiplog.cli, pipelines.prepare, pipelines.convert; "
        "sys.exit(any(name in sys.modules for name in ('torch', 'rerun', 'jax')))"
    )
    assert subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=False).returncode == 0
