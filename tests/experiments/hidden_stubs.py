"""A simulator, a shiplog and rivals that do nothing, for the runner of hidden effects."""

import sys

from pipelines.experiments.hidden_effects import run

SIMULATOR = """
import json, pathlib, sys
seed, logs, _, key, *options = sys.argv[1:]
pathlib.Path(logs).mkdir()
if "--family" in options:
    (pathlib.Path(logs) / "ship.toml").write_text("")
pathlib.Path(key).write_text(json.dumps({"verdict": "none", "causes": [], "structure": None}))
"""
SHIPLOG = """
import json, os, pathlib, sys
command, first, *options = sys.argv[1:]
given = {k: v for k, v in zip(options, options[1:])}
made = {"ingest": "--store", "train": "--out"}.get(command)
if command == "ingest":
    own = pathlib.Path(first, "ship.toml").exists()
    assert given["--profile"] == (str(pathlib.Path(first, "ship.toml")) if own else "esso-vectwin")
if made:
    pathlib.Path(given[made]).mkdir()
else:
    assert pathlib.Path(first).is_dir() and pathlib.Path(given["--store"]).is_dir()
    pathlib.Path(given["--json"]).write_text(json.dumps({"verdict": os.environ["SAYS"]}))
"""
RIVALS = """
import json, pathlib, sys
base, *options = sys.argv[1:]
given = {k: v for k, v in zip(options, options[1:])}
json_ = pathlib.Path(given["--json"])
assert "keys" not in " ".join(sys.argv) and given["--voyages"] == "trial_*"
assert pathlib.Path(base).is_dir() and pathlib.Path(given["--store"]).is_dir()
assert (json_.parent / "verdict.sha256").exists()  # it comes last
json_.write_text(json.dumps({"methods": {"glr": {"answer": None, "ranking": []}}}))
"""


def programs(folder, monkeypatch):
    """Settings that run these programs, which are files of the folder; SAYS is their verdict."""
    monkeypatch.setenv("SAYS", "none")
    commands = {}
    for name, source in (("case", SIMULATOR), ("shiplog", SHIPLOG), ("rival", RIVALS)):
        (folder / f"{name}.py").write_text(source)
        commands[name] = (sys.executable, str(folder / f"{name}.py"))
    return lambda **more: run.Settings(**commands, abroad=commands["case"], **more)


def names_in(out, label="5"):
    return {p.name for p in (out / "cases" / label).iterdir()}
