"""`import shiplog` as a notebook uses it: names, attributes, frames, and what a wrong one says."""

import inspect
import re
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import shiplog
from shiplog.models.causes import CATALOGUE
from shiplog.report.diagnosis.diagnosis import Diagnosis
from shiplog.report.diagnosis.sections.causes import Estimate, NamedCause
from shiplog.report.diagnosis.verdict import Verdict
from shiplog.simulation.extended_simulator import Extension
from shiplog.training.runs import coefficients, load_model
from shiplog.training.settings.options import TrainOptions
from shiplog.training.settings.run_config import DEVICES, RECIPES, WIND_INPUTS

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def opened(store):
    return shiplog.open_store(store)


@pytest.fixture(scope="module")
def scored(opened, published):
    return shiplog.evaluate(published[0], opened, opened["trip_3"])


def test_train_has_every_option_with_its_default():
    known = {one.name: one.default for one in fields(TrainOptions)}
    given = inspect.signature(shiplog.train).parameters
    more = ("store", "out", "mapping", "logs")  # the last two of a simulator of the user's own
    assert {n: p.default for n, p in given.items() if n not in more} == known
    assert all(given[name].kind is inspect.Parameter.KEYWORD_ONLY for name in known)


@pytest.mark.parametrize(
    ("option", "words"), [("recipe", RECIPES), ("device", DEVICES), ("wind_input", WIND_INPUTS)]
)
def test_an_editor_completes_the_words_of_an_option(option, words):
    hint = shiplog.train.__annotations__[option]
    found = re.findall(r'"(\w+)"|\'(\w+)\'', hint.removesuffix(" | None"))
    found = [one or other for one, other in found]
    assert set(found) == set(words)


def test_a_wrong_option_is_named(opened, tmp_path):
    with pytest.raises(TypeError, match="'modle'"):
        shiplog.train(opened, tmp_path / "run", modle="mmg")
    assert not (tmp_path / "run").exists()


def test_the_version_is_that_of_the_package():
    assert shiplog.__version__ in (ROOT / "pyproject.toml").read_text(encoding="utf-8")


def test_every_name_is_there():
    for name in shiplog.__all__:
        assert getattr(shiplog, name) is not None


def test_a_store_is_a_collection_of_voyages(opened):
    names = ["trip_1", "trip_2", "trip_3"]
    assert [voyage.name for voyage in opened] == names and len(opened) == 3
    assert "trip_2" in opened and "trip_2[0:40]" in opened
    assert "trip_4" not in opened and "trip_2[4000:4100]" not in opened
    assert repr(opened).count("\n") == 0 and "3 voyages" in repr(opened)


def test_a_voyage_has_rows_and_findings(opened):
    voyage = opened["trip_1"]
    # 80 s were sailed; the last instrument begins some samples later
    assert voyage.seconds == pytest.approx(80.0, abs=0.5)
    table = voyage.table_10hz
    assert isinstance(table, pl.LazyFrame)
    assert table.collect().height == round(voyage.seconds * 10) + 1
    assert voyage.rows_1hz.height == pytest.approx(80, abs=1)
    assert f"{voyage.start:%H:%M}" == "11:00"
    assert voyage.profile.ship.name == voyage.ship
    assert voyage.findings_frame.height == len(voyage.findings) == len(voyage.json["findings"])
    assert repr(voyage).startswith("Voyage('trip_1': 80 s from 2026-05-01 11:00:0")


def test_a_part_of_a_voyage_has_its_own_rows(opened):
    part = opened["trip_1[20:50]"]
    assert (part.name, part.seconds) == ("trip_1[20:50]", 30)
    assert part.table_10hz.collect().height == 300
    assert (part.start - opened["trip_1"].start).total_seconds() == 20.0


def test_a_wrong_name_is_a_key_error_that_lists_near_ones(opened):
    with pytest.raises(KeyError) as told:
        opened["trp_1"]
    assert isinstance(told.value, shiplog.ShiplogError)
    assert "trip_1, trip_2, trip_3" in str(told.value)
    with pytest.raises(KeyError, match="There are trip_1"):
        opened[0]


def test_a_folder_that_is_no_store_has_a_repr(tmp_path):
    (tmp_path / "file").touch()
    assert repr(shiplog.Store(tmp_path / "file")) == f"Store('{tmp_path / 'file'}')"


def test_an_evaluation_of_one_run_has_its_numbers_as_attributes(scored):
    known = scored.json
    assert scored.loss == known["loss"] == scored["published"].loss
    assert scored.baselines == known["floors"]
    assert scored.rmse == known["rmse"]
    assert scored.end_position_m == known["end_position_m"]
    assert scored.end_heading_deg == known["end_heading_deg"]
    assert scored.windows == known["windows"]
    assert scored["published"].sentence in scored.text
    assert scored.summary["loss"].to_list() == [scored.loss, *scored.baselines.values()]


def test_a_window_that_does_not_suit_the_ship_is_said(scored):
    """25 s are three ship times of 3 m at 0.4 m/s, where the paper's 100 s are 13."""
    assert "auto takes 100 s" in scored.window_advice
    assert scored.window_advice in scored.lines


def test_an_evaluation_of_several_runs_asks_which(opened, published, tmp_path):
    other = tmp_path / "other"
    other.symlink_to(published[0])
    scored = shiplog.evaluate([published[0], other], opened, "trip_3")
    assert [one.run for one in scored] == ["published", "other"]
    assert scored["other"].loss == scored["published"].loss
    with pytest.raises(AttributeError, match=r"evaluation\['other'\]\.loss"):
        _ = scored.loss
    with pytest.raises(KeyError, match="it has other, published"):
        scored["mmg"]


def test_coefficients_are_those_of_the_run_folder(published):
    run = shiplog.load(published[0])
    known = run.identified()
    assert list(run.coefficients) == known["name"].to_list()
    one = run.coefficients["hull.y_v"]
    assert float(one) == known.row(by_predicate=pl.col("name") == "hull.y_v", named=True)["value"]
    assert (one.low, one.high) == (None, None)  # nothing was fitted
    assert str(one).endswith(", Y'_v, sway damping") and " to " not in str(one)
    assert run.coefficients_frame["unit"].to_list() == known["unit"].to_list()
    assert "fitted to no voyage" in repr(run)


def test_an_identified_coefficient_has_its_interval(published, monkeypatch):
    run = shiplog.load(published[0])
    fitted = run.identified().with_columns(free=pl.lit(True), standard_error=pl.lit(0.1))
    monkeypatch.setattr(load_model.Run, "identified", lambda self, seed=0: fitted)
    one = run.coefficients["hull.y_v"]
    assert one.high - one.low == pytest.approx(2 * 0.1645)
    assert one.value == pytest.approx((one.high + one.low) / 2)
    assert f"({one.low:.3g} to {one.high:.3g})" in str(one)


def test_an_extended_run_has_its_causes_parameters_after_the_bases(published):
    """A current of 0.5 m/s towards 53.13 deg; one coefficient was fitted again."""
    run = shiplog.load(published[0])
    base = run.identified()["value"].to_numpy().copy()
    base[0] *= 1.5
    (current,) = [cause for cause in CATALOGUE if cause.label == "current"]
    held = Extension(
        (current,), {"current": np.array([0.3, 0.4])}, {"current": np.diag([1e-4, 1e-4])}, {}, {},
        {}, base,
    )  # fmt: skip
    found = coefficients.of(run.identified(), held)
    names = run.identified()["name"].to_list()
    assert list(found) == [*names, "current.speed", "current.direction"]
    speed, direction = found["current.speed"], found["current.direction"]
    assert (speed.value, speed.unit, speed.cause) == (pytest.approx(0.5), "m/s", "current")
    # 0.01 m/s of either component are 0.01 m/s along the current: 1.645 of them to each side
    assert speed.high - speed.low == pytest.approx(2 * 1.645 * 0.01, rel=0.05)
    assert (direction.value, direction.unit) == (pytest.approx(53.13, abs=0.01), "deg")
    first, known = found[names[0]], run.coefficients[names[0]]
    assert (first.value, first.start) == (base[0], known.value) and first.low is None
    assert coefficients.of(None, held).keys() == {"current.speed", "current.direction"}


def test_a_diagnosis_has_the_verdict_as_attributes(tmp_path):
    speed = Estimate(0.11, 0.10, 0.12, "m/s")
    cause = NamedCause(
        name="current", probability=0.97, parameters={"speed": speed}, sentence="", equation=""
    )
    found = Diagnosis(Verdict("named", "A current.", "mmg", True, "", causes=(cause,)), tmp_path)
    assert found.named == ("current",) and found.sentence == "A current."
    assert found.parameters["current"]["speed"].value == 0.11
    assert (found.gain, found.explained) == (None, 0.0)
    assert repr(found) == f"Diagnosis(mmg: named, current; {tmp_path})"


def test_logs_are_checked_and_drafted_without_a_store(logs):
    checked = shiplog.check(logs)
    assert checked.store is None and checked.voyages["name"].to_list()[0] == "trip_1"
    assert checked.findings.height == sum(len(one.findings) for one in checked.reports)
    assert "3 voyages" in repr(checked)
    draft = shiplog.profile(logs / "trip_1.mcap")
    assert "ship.length_m" in draft.unchecked and draft.written is None
    with pytest.raises(shiplog.ShiplogError, match="does not exist"):
        shiplog.check("nowhere.mcap")


def test_sensors_of_stored_voyages_are_frames(opened):
    found = shiplog.sensors(opened)
    assert found.json["campaigns"][0]["voyages"] == ["trip_1", "trip_2", "trip_3"]
    assert found.estimates.height == len(found.json["campaigns"][0]["estimates"])
    assert "trip_1 to trip_3" in found.text and "1 campaign" in repr(found)


def test_nothing_converted_is_an_error(tmp_path):
    (tmp_path / "table.csv").write_text("a,b\n1,2\n")
    with pytest.raises(shiplog.ShiplogError):
        shiplog.convert(tmp_path / "table.csv", tmp_path / "logs")


def test_a_store_opens_without_what_is_heavy(store):
    program = (
        "import sys, shiplog; found = shiplog.open_store(sys.argv[1]); len(found), repr(found); "
        "sys.exit(any(n in sys.modules for n in ('polars', 'pydantic', 'numpy', 'jax', 'torch')))"
    )
    done = subprocess.run([sys.executable, "-c", program, store], cwd=ROOT, check=False)
    assert done.returncode == 0
