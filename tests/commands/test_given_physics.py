"""Physical models as published, opened, extended and refused."""

import json
import math
import subprocess
import sys
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from commands import call
from own_causes import GOOD
from short_voyages import BOTH, HULL, STATES, WINDOW, scored, train

import shiplog
from pipelines.experiments import simulated_ship
from shiplog.exceptions import RunError
from shiplog.models.causes import CATALOGUE, user
from shiplog.training.runs import extension_file, load_model

# ---------------------------------------------------------------- as published


def test_an_unfitted_model_is_evaluated_like_any_other(published, store, tmp_path):
    run, reported = published
    assert "mmg as given, without propeller, rudder" in reported
    assert "over the 6 windows named, with nothing fitted" in reported
    content = scored(run, store, tmp_path / "e.json")
    assert math.isfinite(content["loss"]) and content["loss"] > 0.0
    assert len(content["seeds"]) == 1 and content["windows"] == 3
    assert sorted(content["band_90"]) == sorted(STATES)
    assert all(0.0 <= share <= 1.0 for share in content["band_90"].values())


def test_no_command_of_a_physical_model_loads_torch(published, store, tmp_path):
    """It is trained, evaluated and diagnosed by other libraries."""
    kept = ("--store", store, "--voyages")
    commands = (
        ("train", *kept, "trip_1", "--out", "own", *WINDOW, "--model", "mmg", "--no-fit", *HULL),
        ("evaluate", published[0], *kept, "trip_3"),
        ("diagnose", published[0], *kept, "trip_3", "--out", "found"),
    )
    program = (
        "import sys, json; from shiplog import cli; "
        "[cli.run(one) for one in json.loads(sys.argv[1])]; sys.exit('torch' in sys.modules)"
    )
    words = json.dumps([[str(word) for word in one] for one in commands])
    done = subprocess.run(
        [sys.executable, "-c", program, words], cwd=tmp_path, check=False, capture_output=True
    )
    assert done.returncode == 0, done.stderr.decode()
    assert (tmp_path / "found" / "verdict.json").is_file() and (tmp_path / "own").is_dir()


def test_code_in_a_run_folder_is_never_run(published, store, tmp_path):
    """A run may be anybody's: a cause of its owner's comes from --cause FILE, given again."""
    ran = tmp_path / "ran"
    mine = tmp_path / "mine.py"
    mine.write_text(f"{GOOD}\nwith open({str(ran)!r}, 'a') as f:\n    f.write('x')\n")
    causes = user.load([mine])
    run = load_model.load(published[0])
    after = run.extended(0).with_causes(
        causes, {"tide_gate": np.array([3.0])}, {"tide_gate": np.array([[0.01]])}
    )
    kept = extension_file.extend(run, tmp_path / "extended", after, [mine])
    assert load_model.load(kept, causes).label == "mmg with tide_gate"
    was = ran.read_text()
    for command in ("evaluate", "compare"):
        code, _, reported = call(command, kept, "--store", store, "--voyages", "trip_3")
        assert code == 1 and "'tide_gate'" not in reported and "tide_gate" in reported
        assert f"--cause FILE; a copy to look over first: {kept / 'extension-0.py'}" in reported
    assert ran.read_text() == was
    with pytest.raises(RunError, match="--cause"):
        load_model.load(kept).models()
    again = load_model.load(kept, user.load([mine])).models()[0]
    assert again.theta == pytest.approx(after.theta)
    code, reported, _ = call("evaluate", kept, "--store", store, "--voyages", "trip_3",
                         "--cause", mine)  # fmt: skip
    assert code == 0 and "mmg with tide_gate" in reported
    assert ran.read_text() == was + "xx"
    opened = shiplog.load(kept, mine)  # in Python likewise
    found = shiplog.evaluate(opened, store, "trip_3", causes=mine)
    assert "mmg with tide_gate" in found.text
    drawn = shiplog.compare(opened, store, "trip_3", save=tmp_path / "a.rrd", causes=[mine])
    assert "mmg with tide_gate" in drawn.text and drawn.recording.is_file()


def test_a_run_extended_by_the_catalogues_causes_needs_no_file(published, tmp_path):
    """Also where the owner's causes were tested and not named: nothing of theirs is in it."""
    mine = tmp_path / "mine.py"
    mine.write_text(GOOD)
    run = load_model.load(published[0])
    (current,) = [c for c in CATALOGUE if c.label == "current"]
    numbers = {"current": np.array([0.1, -0.05])}
    after = run.extended(0).with_causes([current], numbers, {"current": 1e-4 * np.eye(2)})
    kept = extension_file.extend(run, tmp_path / "extended", after, [mine])
    assert load_model.load(kept).extension_numbers()["current"] == pytest.approx([0.1, -0.05])
    assert not list(kept.glob("*.py"))


def test_an_extension_was_fitted_to_its_own_voyages_and_shows_no_forces(published, tmp_path):
    """They test neither it nor a run evaluated with it; a current is no force of the equations."""
    run = load_model.load(published[0])
    (current,) = [c for c in CATALOGUE if c.label == "current"]
    after = run.extended(0).with_causes(
        [current], {"current": np.array([0.1, -0.05])}, {"current": 1e-4 * np.eye(2)}
    )
    after = replace(after, shares={"later": (0.0, 1.0)}, lengths={"later": 150.0})
    kept = load_model.load(extension_file.extend(run, tmp_path / "extended", after, []))
    assert run.fitted_to == run.trained_on == kept.trained_on
    assert kept.fitted_to == (*run.trained_on, "later")
    rows = run.training()
    assert run.forces(rows) is not None and kept.forces(rows) is None


def test_nothing_fitted_is_the_start_and_sure_of_nothing(published):
    run = load_model.load(published[0])
    identified = run.identified()
    assert (identified["value"] == identified["start"]).all()
    assert not identified["free"].any() and (identified["standard_error"] == 0.0).all()
    assert not (run.path / "cross_validation.parquet").exists()
    assert not run.simulator(0).covariance.any()
    assert run.config.physics.parameters == "empirical formulas from the particulars"


def test_a_force_left_out_is_reported_and_gone(store, tmp_path):
    code, reported, _ = train(
        store, tmp_path / "r", "--model", "mmg", "--no-fit", *BOTH, *HULL, "--without", "wind"
    )
    assert code == 0 and "mmg as given, without propeller, rudder, wind in" in reported
    names = load_model.load(tmp_path / "r").identified()["name"]
    assert {name.split(".")[0] for name in names} == {"body", "hull"}


# ---------------------------------------------------------------- what is refused


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--free", "wind.y_1"), ["No parameter is called 'wind.y_1'", "did you mean 'wind.y1'"]),
        (("--free", "nonsense"), ["No parameter is called 'nonsense'", "hull.y_v", "'wind.*'"]),
        (("--free", "rudder.*"), ["No parameter is called 'rudder.*'"]),  # it was left out
        (("--parameters", "nowhere.toml"), ["nowhere.toml cannot be read"]),
    ],
)
def test_a_wrong_choice_names_the_right_ones(store, tmp_path, arguments, words):
    code, _, reported = train(store, tmp_path / "r", "--model", "mmg", *BOTH, *HULL, *arguments)
    assert code == 1
    for word in words:
        assert word in reported
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("force", "words"),
    [
        ("wing", "no force 'wing' to leave out (did you mean 'wind'?)"),
        ("hull", "no force 'hull' to leave out"),
    ],
)
def test_a_force_that_cannot_be_left_out_is_wrong_usage(tmp_path, force, words):
    """Answered before the store is read: here there is none."""
    code, _, reported = train(
        tmp_path / "none", tmp_path / "r", "--model", "mmg", "--without", force
    )
    assert code == 2 and words in reported
    assert "--without can be propeller, rudder, thruster, wind." in reported
    assert not list(tmp_path.iterdir())


def test_a_window_longer_than_every_voyage_is_refused(store, tmp_path):
    code, _, reported = call("train", "--store", store, "--out", tmp_path / "r", "--model", "mmg",
                         "--window", 400, *BOTH, *HULL)  # fmt: skip
    assert code == 1 and "longer than every" in reported
    assert not list(tmp_path.iterdir())


def test_voyages_shorter_than_a_runs_window_are_refused_with_what_can_be_done(published, tmp_path):
    """A run's window is chosen when it is trained: `evaluate` has no --window."""
    logs, store = tmp_path / "logs", tmp_path / "store"
    logs.mkdir()
    voyage = simulated_ship.sail(15.0, seed=5, wind=simulated_ship.Wind(3.0, 5))
    simulated_ship.write_voyage(
        logs / "brief.mcap", voyage, seed=5, start=datetime(2026, 5, 2, tzinfo=UTC)
    )
    assert call("ingest", logs, "--store", store)[0] == 0
    for command in ("evaluate", "compare"):
        code, _, reported = call(command, published[0], "--store", store, "--voyages", "brief")
        assert code == 1 and reported == (
            "published has windows of 25 s, and there are no 25 s without a gap in brief.\n"
            "  choose longer voyages with --voyages, or train a run with a shorter --window."
        )


def test_a_hybrid_has_to_be_fitted(store, tmp_path):
    code, _, reported = train(store, tmp_path / "r", "--model", "hybrid", "--no-fit", *BOTH)
    assert code == 2 and "has to be fitted" in reported and "--model mmg" in reported
    assert not list(tmp_path.iterdir())


def test_a_hybrid_needs_a_second_voyage(store, tmp_path):
    code, _, reported = train(store, tmp_path / "r", "--model", "hybrid", "--voyages", "trip_1",
                          "--free", "wind.*", *HULL)  # fmt: skip
    assert code == 1 and "needs a voyage to hold out" in reported and "--validation" in reported
    assert not (tmp_path / "r").exists()
