"""One direction: a package, and a room within it, imports from those above it in these lists."""

import ast
import graphlib
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
# A package and what it is.
ROWS = {
    "exceptions": "what a user can mend",
    "nomenclature": "channels, units, frames, numbers",
    "machine": "files, paths, caches, limits",
    "ship_profile": "profile, its file, units of channels",
    "logs": "MCAP in and out; health of a log",
    "voyages": "10 Hz tables, their store, 1 Hz rows, windows; sensors against each other",
    "drafting": "a profile drafted from a log or a table",
    "models": "dynamic models, and causes as terms of them",
    "foreign": "simulators of others, each in a child process",
    "simulation": "rollouts, derivatives, errors, baselines",
    "training": "recipes, identification, run folders",
    "diagnosis": "segments, hypotheses, posterior, refutation",
    "manoeuvres": "recognition, quantities, criteria",
    "planning": "what to sail next, and what it would show",
    "report": "verdict, pages, tables, viewer",
    "export": "a run in files of other programs, compared with itself",
    "live": "a model next to its ship: causal rows, error, evidence, alarm",
    "commands": "what each command does, and its answer",
    "cli": "arguments and printing",
}
# The rooms of a package, in the order of its method. What stands beside them may be used by all.
ROOMS = {
    "logs": ("mcap_file", "decoding", "health", "reading", "conversion"),
    "voyages": (
        "rows", "clocks", "samples", "contradictions", "sensors", "ingest", "store", "windows",
    ),
    "training": ("settings", "network", "physics", "runs"),
    "diagnosis": (
        "linear", "noise", "nominal", "trial", "hypotheses", "verdict", "onset", "season",
        "residual",
    ),
    "report": (
        "evaluation", "figures", "viewer", "diagnosis", "paper", "page", "gate", "fleet",
        "manoeuvres", "season",
    ),
}  # fmt: skip
LEVEL = {name: level for level, name in enumerate(ROWS)}
SOURCES = sorted((ROOT / "shiplog").rglob("*.py"))
ONLY = {  # a library, and the packages and modules that may import it
    "mcap": {"logs", "live"}, "mcap_protobuf": {"logs"}, "mcap_ros2": {"logs"}, "pynmea2": {"logs"},
    "rosbags": {"logs"}, "rerun": {"logs", "report", "export", "live"}, "ray": {"training"},
    "matplotlib": {"report"}, "jinja2": {"report"}, "typer": {"cli"}, "pickle": set(),
    "torch": {"training", "shiplog.models.feedforward"}, "pymavlink": {"logs"},
    "fmpy": {"export", "foreign"}, "onnx": {"export"}, "onnxruntime": {"export"},
}  # fmt: skip


def dotted(path):
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


MODULES = {dotted(path): path for path in SOURCES}


def package(module):
    """Of a dotted name that begins with shiplog; None of `shiplog` itself, which is the API."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else None


def room(module):
    """The room's place in its package; None of what stands beside the rooms."""
    parts = module.split(".")
    rooms = ROOMS.get(parts[1], ()) if len(parts) > 2 else ()
    return rooms.index(parts[2]) if rooms and parts[2] in rooms else None


def imported(path):
    """(line, full module name) of every import, wherever in the file it stands."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            module = node.module or ""
            named = [f"{module}.{alias.name}" for alias in node.names]
            of = [name for name in named if name in MODULES]
            yield from ((node.lineno, name) for name in of or [module])


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_go_one_way(path):
    name = dotted(path)
    own = package(name)
    for line, module in imported(path):
        top = module.split(".")[0]
        where = f"{path.relative_to(ROOT)}:{line} imports {module}"
        assert top != "pipelines", where
        if top == "shiplog" and (of := package(module)) and own:
            assert LEVEL[of] <= LEVEL[own], where
            if of == own and None not in (here := room(name), there := room(module)):
                assert there <= here, where
        if top in ONLY:
            assert ONLY[top] & {own, name}, where


def test_imports_are_absolute():
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            assert not isinstance(node, ast.ImportFrom) or node.level == 0, path


@pytest.mark.parametrize("name", ROWS)
def test_a_package_has_no_circle(name):
    """What a module imports stands before it, in some order of them all."""
    modules = {own: path for own, path in MODULES.items() if package(own) == name}
    uses = {
        own: {module for _, module in imported(path) if module in modules and module != own}
        for own, path in modules.items()
    }
    assert modules
    list(graphlib.TopologicalSorter(uses).static_order())  # raises CycleError


def test_every_folder_is_a_row():
    folders = {
        path.name for path in (ROOT / "shiplog").iterdir() if (path / "__init__.py").exists()
    }
    assert folders == set(ROWS) - {"exceptions"}
    for name, rooms in ROOMS.items():
        of = (ROOT / "shiplog" / name).iterdir()
        assert {path.name for path in of if (path / "__init__.py").exists()} == set(rooms)


def test_commands_word_no_error():
    """An error's text stands in the library, where its subject is; the API passes some on."""
    for path in (ROOT / "shiplog" / "commands").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            made = isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call)
            assert not made or not node.exc.args or isinstance(node.exc.args[0], ast.Call), (
                f"{path.name}:{node.lineno}"
            )


def test_commands_that_need_no_network_do_not_load_torch():
    """It costs seconds and 200 MB: ingest, check and voyages do without, and `train` until its
    arguments are checked."""
    program = (
        "import sys, shiplog.cli; from shiplog.commands import convert, prepare, train; "
        "sys.exit(any(name in sys.modules for name in ('torch', 'rerun', 'jax', "
        "'pymavlink', 'nmea2000', 'pyulog', 'h5py', 'fastexcel')))"
    )
    assert subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=False).returncode == 0


def test_what_runs_no_network_does_not_load_torch():
    """A diagnosis, an evaluation and a training of an MMG; and what they leave open until it is
    known which model a run is of."""
    program = (
        "import sys; from shiplog.commands import api, diagnose, evaluate, gate, identify, "
        "train, train_again; sys.exit('torch' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=False).returncode == 0
