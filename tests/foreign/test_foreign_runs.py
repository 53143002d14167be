"""Runs of simulators of one's own: trained, evaluated, refused, and logged ones read back."""

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import sailing
from typer.testing import CliRunner

from shiplog.cli.app import app
from shiplog.commands.evaluate import evaluate_runs
from shiplog.commands.train_foreign import Given, foreign_command
from shiplog.exceptions import RunError, UsageError
from shiplog.foreign.source import SimulatorError
from shiplog.logs.conversion.write import Series, write_log
from shiplog.models.causes import CATALOGUE
from shiplog.planning.plan import CannotPlan
from shiplog.training.runs import foreign_run, load_model
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.store.store import Store

ODD = Path(__file__).parent / "odd.py"
CIRCLE = """
import numpy as np

def f(state, inputs, t):
    '''Turns on a circle of 20 m at 0.8 m/s, whatever is ordered; what differs is damped.'''
    u, v, psi, r = (state[..., i] for i in (1, 3, 4, 5))
    du, dv, dr = 0.8 - u, -v, 0.04 - r
    c, s = np.cos(psi), np.sin(psi)
    return np.stack((u * c - v * s, du, u * s + v * c, dv, r, dr), -1)
"""
TOPIC = "/sim/given/state"


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """A circle with its own states on a topic, 5 cm/s too fast ahead: two voyages of two."""
    folder = tmp_path_factory.mktemp("circles")
    store = Store(folder / "store")
    for number, name in enumerate(("first", "second")):
        parts = sailing.series(130.0)
        rng = np.random.default_rng(number)
        for one in parts.values():
            for column, values in one.columns.items():
                noise = rng.normal(0, 1e-3, len(values))
                one.columns[column] = values + noise  # type: ignore[index]  # a dict
        truth = sailing.circle(130.0, 0.0)
        parts[TOPIC] = Series(TOPIC, "shiplog.ShipState", sailing.stamps(truth["t"]), {
            "x0_m": truth["x0"] + 300.0, "y0_m": truth["y0"], "surge_mps": 0.85 + 0.0 * truth["t"],
            "heading_deg": np.degrees(truth["heading"]) % 360.0, "sway_mps": 0.0 * truth["t"],
            "yaw_rate_degps": np.degrees(truth["yaw_rate"]),
        })  # fmt: skip
        log = folder / f"{name}.mcap"
        write_log(log, list(parts.values()), ship="circle")
        store.add(ingest(log, sailing.profile()))
    return store


def trained(store, out, given, voyages=("first",)):
    return foreign_command(given, store.path, out, voyages, (), 60)


def test_a_callable_is_a_run_that_keeps_no_code(store, tmp_path):
    file = tmp_path / "given.py"
    file.write_text(CIRCLE)
    found = trained(store, tmp_path / "run", Given(str(file)))
    assert found.complete
    kept = list((tmp_path / "run").rglob("*"))
    assert not [path for path in kept if path.suffix == ".py"]
    assert not [one for one in kept if one.is_file() and b"whatever is" in one.read_bytes()]
    assert found.json["simulator"]["sha256"] in (tmp_path / "run" / "config.toml").read_text()
    scores = evaluate_runs([tmp_path / "run"], store, ["second"], simulators=[str(file)])
    assert scores.loss < 0.5 * scores.baselines["hold"]  # which is noise of the instruments
    assert scores.rmse["surge"] < 0.01
    # without it, and with another
    with pytest.raises(RunError, match="keeps no code of it"):
        evaluate_runs([tmp_path / "run"], store, ["second"])
    file.write_text(CIRCLE + "\n")
    with pytest.raises(SimulatorError, match="is not the simulator"):
        evaluate_runs([tmp_path / "run"], store, ["second"], simulators=[str(file)])
    foreign_run.close()


def test_one_that_raises_half_way_costs_its_windows(store, tmp_path):
    """From 30 s on: in the second window of a voyage, and in the first at 30 s."""
    file = tmp_path / "raising.py"
    file.write_text(CIRCLE.replace("    u, v", "    if np.max(t) >= 90.0:\n        "
                                   "raise RuntimeError('no more fuel')\n    u, v"))  # fmt: skip
    found = trained(store, tmp_path / "run", Given(str(file)))
    assert not found.complete
    (one,) = found.json["failures"]
    assert (one["voyage"], one["words"]) == ("first", "raised RuntimeError: no more fuel")
    assert one["second"] == pytest.approx(90.0, abs=0.2)
    assert found.json["failed_windows"] == 1 and np.isfinite(found.json["loss"])
    foreign_run.close()


def test_what_was_logged_is_a_run(store, tmp_path):
    """Surge is 0.05 m/s too large in every second, and all else is right."""
    given = Given(f"logs:{TOPIC}", logs=(store.path.parent,))
    found = trained(store, tmp_path / "run", given)
    assert "states that were logged" in "\n".join(found.lines)
    scores = evaluate_runs([tmp_path / "run"], store, ["second"])
    assert scores.rmse["surge"] == pytest.approx(0.05, abs=5e-3)
    assert scores.rmse["sway"] == pytest.approx(0.0, abs=5e-3)
    end = scores.rollouts.sort("time").tail(1).select("x0", "y0").row(0)
    measured = scores.rows.sort("elapsed")
    near = measured.filter(pl.col("elapsed").is_close(scores.rollouts["time"].max()))
    assert end == pytest.approx(near.select("x0", "y0").row(0), abs=0.1)
    run = load_model.load(tmp_path / "run")
    with pytest.raises(Exception, match="cannot be sailed"):
        run.simulate(pl.DataFrame({"time": [0.0, 1.0], "rudder": [0.0, 0.0],
                                   "propeller": [5.0, 5.0]}))  # fmt: skip


def test_what_was_logged_has_no_model_to_write(store, tmp_path):
    given = Given(f"logs:{TOPIC}", logs=(store.path.parent,))
    trained(store, tmp_path / "run", given)
    write = ["export", str(tmp_path / "run"), "--out", str(tmp_path / "x")]
    refused = CliRunner().invoke(app, [*write, "--to", "cpp"])
    assert "has no model to write" in str(refused.exception)
    where = ["--to", "csv", "--store", str(store.path), "--voyages", "second"]
    done = CliRunner().invoke(app, [*write, *where])
    assert done.exit_code == 0, done.exception
    rows = pl.read_csv(tmp_path / "x")
    assert (rows["surge"] - rows["measured_surge"]).mean() == pytest.approx(0.05, abs=5e-3)


def test_a_poor_stand_in_changes_no_ship(store, tmp_path):
    """It leaves 60 % of the accelerations: sensors, current and forces are tested all the same."""
    file = tmp_path / "given.py"
    file.write_text(CIRCLE)
    trained(store, tmp_path / "run", Given(str(file)))
    run = load_model.load(tmp_path / "run", simulators=[str(file)])
    kept = foreign_run.kept(run)
    values = kept.values if len(kept.values) else np.ones(3)
    foreign_run.save(run, kept._replace(values=values, misfit=np.full(3, 0.6)))
    assert "leaves 60%" in run.fixed and not run.lacks
    foreign_run.save(run, kept._replace(values=values, misfit=np.full(3, 0.1)))
    assert not run.fixed
    assert {c.name for c in CATALOGUE if c.changes_ship} >= {"fouling", "payload", "wind_force"}
    assert not {c.name for c in CATALOGUE if c.changes_ship} & {"current", "clock_offset", "bank"}
    foreign_run.close()


def test_logs_without_the_topic_are_refused(store, tmp_path):
    given = Given("logs:/sim/other/state", logs=(store.path.parent,))
    with pytest.raises(SimulatorError, match="has no states on /sim/other/state"):
        trained(store, tmp_path / "run", given)
    with pytest.raises(SimulatorError, match="no log in"):
        trained(store, tmp_path / "run", Given(f"logs:{TOPIC}", logs=(tmp_path,)))


def test_the_command_line(store, tmp_path):
    file = tmp_path / "given.py"
    file.write_text(CIRCLE)
    run, to = tmp_path / "run", tmp_path / "answer.json"
    where = ["--store", str(store.path)]
    invoke = CliRunner().invoke
    made = ["train", "--model", str(file), "--voyages", "first", "--window", "60"]
    made += ["--out", str(run)]
    refused = invoke(app, [*made, *where, "--epochs", "3"])
    assert isinstance(refused.exception, UsageError)
    done = invoke(app, [*made, *where, "--json", str(to)])
    assert done.exit_code == 0, done.output
    assert json.loads(to.read_text())["simulator"]["name"] == "given.py"
    asked = invoke(app, ["evaluate", str(run), *where, "--voyages", "second",
                         "--simulator", str(file)])  # fmt: skip
    assert asked.exit_code == 0 and "given.py" in asked.output
    sailed = invoke(app, ["simulate", str(run), "--zigzag", "10/10", "--members", "1",
                          "--simulator", str(file)])  # fmt: skip
    assert sailed.exit_code == 0, sailed.output
    planned = invoke(app, ["plan", str(run), *where, "--simulator", str(file)])
    assert isinstance(planned.exception, CannotPlan)
    assert "--causes-only" in str(planned.exception.hint)
    foreign_run.close()
