"""`shiplog train --model mmg` as a user types it, on short voyages."""

import json
import math
import shutil
import tomllib
from datetime import UTC, datetime
from importlib import resources

import numpy as np
import polars as pl
import pytest
from commands import call
from short_voyages import BOTH, HULL, answer, scored, train

import shiplog
from pipelines.experiments import simulated_ship
from shiplog.exceptions import ShiplogError
from shiplog.training.physics import output_error as identification
from shiplog.training.physics import regularisation
from shiplog.training.runs import load_model


@pytest.fixture(scope="module")
def calm(logs, tmp_path_factory):
    """The same voyages of a ship without wind sensor."""
    folder = tmp_path_factory.mktemp("calm")
    text = (resources.files("shiplog") / "profiles" / "esso-vectwin.toml").read_text("utf-8")
    begin = text.index("[sensors.wind]")
    profile = folder / "calm.toml"
    profile.write_text(text[:begin] + text[text.index("[[actuators]]") :], encoding="utf-8")
    assert call("ingest", logs, "--store", folder / "store", "--profile", profile)[0] == 0
    return folder / "store"


@pytest.fixture(scope="module")
def fitted(store):
    """All of hull and wind identified, three seeds asked for: run folder, text and JSON."""
    out, to = store.parent / "fitted", store.parent / "fitted.json"
    code, reported, _ = train(
        store, out, "--model", "mmg", *BOTH, *HULL, "--seeds", 3, "--json", to
    )
    assert code == 0
    return out, reported, answer(to)


# ---------------------------------------------------------------- identified


def test_eight_lines_matter_and_the_rest_is_in_the_run_folder(fitted):
    run, reported, content = fitted
    lines = reported.strip().splitlines()
    assert len(lines) <= 8
    wanted = ("fitted to trip_1, trip_2: 6 windows of 25 s", "before the fit", "on held-out",
              "holding the velocity", "Worst determined: ", str(run / "training.md"))  # fmt: skip
    assert not [words for words in wanted if words not in reported]
    page = (run / "training.md").read_text(encoding="utf-8")
    assert all(f"- {note}" in page for note in content["notes"])
    assert all(f"| {one['name']} " in page for one in content["parameters"] if one["free"])


def test_the_answer_says_what_was_found(fitted):
    run, reported, content = fitted
    assert set(content) == {"contract", "run", "label", "windows", "notes", "parameters", "split",
                            "trust"}  # fmt: skip
    assert content["contract"] == 1 and content["windows"] == 6
    assert content["label"] == "mmg identified on ref, without propeller, rudder"
    assert len(content["parameters"]) == 3 + 15 + 10
    first = content["parameters"][0]
    assert set(first) == {"name", "symbol", "meaning", "unit", "start", "spread", "value",
                          "standard_error", "free"}  # fmt: skip
    assert first["name"] == "body.m_x" and first["symbol"] == "m'_x"
    assert content["split"]["training"] == ["trip_1", "trip_2"]
    assert any("held-out voyages" in s for s in content["notes"])
    assert f"Next: shiplog evaluate {run}" in reported


def test_every_coefficient_has_a_verdict_with_its_reason(fitted, store, tmp_path):
    """In the answer, in the page of the training, in trust.json and again of `evaluate`."""
    run, reported, content = fitted
    judged = {one["name"]: one for one in content["trust"]}
    assert list(judged) == [one["name"] for one in content["parameters"]]
    kept = json.loads((run / "trust.json").read_text(encoding="utf-8"))["coefficients"]
    assert kept == content["trust"]
    assert " trusted, " in reported and " not measured." in reported
    page = (run / "training.md").read_text(encoding="utf-8")
    assert all(one["reason"] in page for one in judged.values())
    for one in judged.values():
        sure = one["own"] <= 0.5 and not one["at_limit"]
        agree = one["between"] is None or one["between"] <= 0.5 * (one["high"] - one["low"]) / (
            2 * 1.645 * one["own"]
        )
        assert (one["verdict"] == "trusted") == (sure and agree)
        assert one["limits"][0] <= one["typical"][0] <= one["typical"][1] <= one["limits"][1]
        assert one["voyages"] <= 2 and one["source"]
    found = scored(run, store, tmp_path / "scored.json")
    assert found["trust"] == content["trust"]


def test_a_run_of_before_gets_its_verdicts_when_it_is_evaluated(fitted, store, tmp_path):
    shutil.copytree(fitted[0], tmp_path / "old")
    path = tmp_path / "old" / "trust.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    for one in content["coefficients"]:
        del one["apart"]  # as of a program that did not compare parts of the data
    path.write_text(json.dumps(content), encoding="utf-8")
    found = scored(tmp_path / "old", store, tmp_path / "scored.json")
    for one, now in zip(found["trust"], fitted[2]["trust"], strict=True):
        assert one["verdict"] == now["verdict"] and one["own"] == pytest.approx(now["own"])
    assert "apart" in json.loads(path.read_text(encoding="utf-8"))["coefficients"][0]
    path.unlink()
    scored(tmp_path / "old", store, tmp_path / "again.json")
    assert path.is_file()


def test_the_residuals_of_new_voyages_are_tested(fitted, store, tmp_path):
    to = tmp_path / "scored.json"
    assert (
        call("evaluate", fitted[0], "--store", store, "--voyages", "trip_*", "--json", to)[0] == 0
    )
    found = answer(to)["residual_tests"]
    against = {one["against"] for one in found}
    assert {"whiteness", "wind_ahead", "wind_athwart"} <= against
    assert {one["level"] for one in found} == {0.05}
    assert all(one["rejected"] == (one["p"] < 0.05) for one in found)


def test_of_two_runs_the_better_one_is_said(fitted, store, tmp_path):
    """Against the same run as its starting values, which has no voyage that it was held out of."""
    code, _, _ = train(store, tmp_path / "start", "--model", "mmg", *BOTH, *HULL, "--no-fit")
    assert code == 0
    code, reported, _ = call(
        "evaluate", tmp_path / "start", fitted[0], "--store", store, "--voyages", "trip_*",
        "--json", tmp_path / "both.json",
    )  # fmt: skip
    assert code == 0
    content = answer(tmp_path / "both.json")
    (one,) = content["better"]
    assert (one["a"], one["b"]) == ("fitted", "start") and one["elsewhere"] is None
    assert content["runs"]["fitted"]["loss"] / content["runs"]["start"]["loss"] == pytest.approx(
        one["share"]
    )
    assert one["low"] <= one["probability"] <= one["high"] and one["probability"] > 0.5
    assert "P(fitted is better than start on new voyages like these) is 0." in reported
    assert content["runs"]["start"]["trust"] == []  # nothing was fitted


def test_the_training_windows_fit_better_than_at_the_start(fitted):
    run = load_model.load(fitted[0])
    identified = run.identified()
    assert (identified["standard_error"] > 0.0).all() and identified["free"].all()
    assert (identified["standard_error"] <= 1.05 * identified["spread"]).all()
    assert (identified["value"] != identified["start"]).any()
    (sentence,) = [s for s in fitted[2]["notes"] if "training windows" in s]
    assert float(sentence.split("(")[1].split(")")[0]) < 0.9


def test_voyages_are_held_out_in_as_many_parts_as_are_asked_for(fitted, store, tmp_path):
    assert load_model.load(fitted[0]).config.physics.folds == 5
    code, _, _ = train(
        store, tmp_path / "r", "--model", "mmg", *BOTH, *HULL, "--folds", 2, "--free", "hull.x_0f"
    )
    assert code == 0 and load_model.load(tmp_path / "r").config.physics.folds == 2
    assert call("train", "--store", store, "--out", tmp_path / "n", "--folds", 2)[0] == 2


def test_one_identification_stands_for_all_seeds(fitted):
    run = load_model.load(fitted[0])
    assert run.config.seeds == (0,)
    assert sorted(p.name for p in run.path.glob("seed*")) == ["seed0"]


def test_the_run_folder_holds_what_it_says(fitted):
    run = load_model.load(fitted[0])
    settings = tomllib.loads((run.path / "config.toml").read_text(encoding="utf-8"))
    assert not {"network", "paper", "fast"} & settings.keys()
    assert settings["physics"]["without"] == ["propeller", "rudder"]
    assert settings["model"] == "mmg"
    losses = pl.read_parquet(run.path / "cross_validation.parquet")
    assert losses.columns == ["held_out", "group", "window", "start", "loss"]
    assert losses["held_out"].unique().to_list() == ["voyages"]  # one day: no days to hold out
    assert losses["group"].to_list() == ["trip_1"] * 3 + ["trip_2"] * 3
    assert np.isfinite(losses["loss"].to_numpy()).all()
    band = run.band()
    assert band.growth.shape == (25, 6) and band.factor.shape == (6,)
    assert not band.growth[0].any() and (band.growth[1:] > 0).all() and (band.factor > 0).all()
    assert {p.name for p in (run.path / "seed0").iterdir()} == {
        "model.safetensors", "parameters.toml", "identified.parquet"}  # fmt: skip
    simulator = run.simulator(0)
    assert simulator.theta == pytest.approx(run.identified()["value"].to_numpy(), abs=0)
    error = np.sqrt(np.diag(simulator.covariance))
    assert error == pytest.approx(run.identified()["standard_error"].to_numpy())


def test_identified_parameters_can_be_given_again(fitted, published, store, tmp_path):
    run, _, _ = fitted
    toml = run / "seed0" / "parameters.toml"
    assert tomllib.loads(toml.read_text("utf-8"))["source"] == "identified by shiplog in fitted"
    code, _, _ = train(
        store, tmp_path / "again", "--model", "mmg", "--no-fit", "--parameters", toml, *BOTH, *HULL
    )
    assert code == 0
    one, other, before = (
        scored(path, store, tmp_path / "e.json")["loss"]
        for path in (run, tmp_path / "again", published[0])
    )
    assert other == pytest.approx(one, rel=1e-9)
    assert before != pytest.approx(one, rel=1e-3)
    again = load_model.load(tmp_path / "again")
    assert again.config.physics.parameters == "identified by shiplog in fitted"


def test_only_the_free_parameters_move(store, tmp_path):
    code, _, _ = train(store, tmp_path / "r", "--model", "mmg", "--free", "wind.*", *BOTH, *HULL)
    assert code == 0
    found = load_model.load(tmp_path / "r").identified()
    wind = pl.col("name").str.starts_with("wind.")
    moved, held = found.filter(wind), found.filter(~wind)
    assert moved.height == 10 and moved["free"].all()
    assert (moved["value"] != moved["start"]).any() and (moved["standard_error"] > 0).all()
    assert not held["free"].any() and (held["value"] == held["start"]).all()
    assert (held["standard_error"] == 0.0).all()


def test_one_voyage_leaves_the_gain_untested(store, tmp_path):
    run = tmp_path / "one"
    code, reported, _ = train(
        store, run, "--model", "mmg", "--voyages", "trip_1", "--free", "wind.*", *HULL
    )
    assert code == 0 and "One voyage only: nothing was held out" in reported
    assert "held-out" not in reported
    assert not (run / "cross_validation.parquet").exists()
    assert load_model.load(run).band() is None
    content = scored(run, store, tmp_path / "e.json")
    assert math.isfinite(content["loss"]) and content["band_90"] == {}


def test_a_validation_voyage_is_where_the_band_comes_from(store, tmp_path):
    run = tmp_path / "r"
    code, _, _ = train(store, run, "--model", "mmg", "--voyages", "trip_1", "--validation",
                       "trip_2", "--free", "wind.*", *HULL)  # fmt: skip
    assert code == 0
    loaded = load_model.load(run)
    assert loaded.config.split.validation == ("trip_2",)
    assert loaded.training()["voyage"].unique().to_list() == ["trip_1"]
    assert loaded.band() is not None


# ---------------------------------------------------------------- how firm the ridge is


@pytest.fixture(scope="module")
def validated(store):
    """Identified from one voyage, validated on another: run folder and its page."""
    out = store.parent / "validated"
    code, _, _ = train(store, out, "--model", "mmg", "--voyages", "trip_1", "--validation",
                       "trip_2", "--free", "hull.*", *HULL)  # fmt: skip
    assert code == 0
    return out, (out / "training.md").read_text(encoding="utf-8")


def test_validation_voyages_choose_the_ridge_and_it_is_kept(validated):
    run, page = validated
    (line,) = [s for s in page.splitlines() if s.startswith("- Ridge of ")]
    assert "3 validation windows" in line
    chosen = answer(run / "provenance.json")["chosen"]["ridge"]
    assert list(chosen["held_out_loss"]) == ["0.25", "0.5", "1", "2", "4", "8"]
    assert f"{chosen['value']:g}" in chosen["held_out_loss"]
    assert f"L {chosen['held_out_loss']['1']:.0f}" in line or "with the plausible ones" in line


def test_without_validation_voyages_the_ridge_is_the_plausible_one(fitted):
    run, reported, content = fitted
    assert answer(run / "provenance.json")["chosen"] == {
        "ridge": {"value": 1.0, "held_out_loss": {}}
    }
    assert "Ridge of" not in reported and not any("Ridge" in s for s in content["notes"])


def test_the_run_holds_what_was_chosen(store, validated, tmp_path, monkeypatch):
    """Made to choose a quarter, it is the identification with a quarter of every spread, and so
    are the fits without each voyage."""
    monkeypatch.setattr(regularisation, "choose", lambda judged: 0.25)
    asked = []
    plain = identification.identify

    def heard(*given, **named):
        asked.append((named["factor"], named["begin"] is None))
        return plain(*given, **named)

    monkeypatch.setattr(identification, "identify", heard)
    run = tmp_path / "firm"
    code, _, _ = train(store, run, "--model", "mmg", *BOTH, "--validation", "trip_3",
                       "--free", "hull.*", *HULL)  # fmt: skip
    page = (run / "training.md").read_text(encoding="utf-8")
    assert code == 0 and "Ridge of 0.25 times the plausible spreads, chosen on 3" in page
    assert answer(run / "provenance.json")["chosen"]["ridge"]["value"] == 0.25
    assert [factor for factor, _ in asked[:6]] == [1.0, 2.0, 4.0, 8.0, 0.5, 0.25]
    assert asked[6:] == [(0.25, True)] * 2  # a fold begins at the start: it knows nothing of all
    found, loose = load_model.load(run).identified(), load_model.load(validated[0]).identified()
    away = (pl.col("value") - pl.col("start")).abs() / pl.col("spread")
    moved = found.filter("free").select(away.mean()).item()
    assert 0.0 < moved < loose.filter("free").select(away.mean()).item()


def test_a_validation_voyage_without_a_window_is_refused(logs, tmp_path):
    short = simulated_ship.sail(20.0, seed=9, wind=simulated_ship.Wind(3.0, 9))
    begun = datetime(2026, 5, 2, 10, 0, tzinfo=UTC)
    (tmp_path / "logs").mkdir()
    simulated_ship.write_voyage(tmp_path / "logs" / "short.mcap", short, seed=9, start=begun)
    shutil.copy(logs / "trip_1.mcap", tmp_path / "logs")
    assert call("ingest", tmp_path / "logs", "--store", tmp_path / "store")[0] == 0
    code, _, reported = train(tmp_path / "store", tmp_path / "r", "--model", "mmg", "--voyages",
                          "trip_1", "--validation", "short", *HULL)  # fmt: skip
    assert code == 1 and "No window of 25 s in short" in reported and "--window" in reported


# ---------------------------------------------------------------- what is refused


def test_wind_coefficients_need_a_wind_sensor(fitted, calm, tmp_path):
    toml = fitted[0] / "seed0" / "parameters.toml"
    given = ("--model", "mmg", "--no-fit", "--parameters", toml, *BOTH, *HULL)
    code, _, reported = train(calm, tmp_path / "r", *given)
    assert code == 1 and "has a wind force" in reported and "--without wind" in reported
    assert not list(tmp_path.iterdir())
    code, reported, _ = train(calm, tmp_path / "r", *given, "--without", "wind")
    assert code == 0 and "without propeller, rudder, wind" in reported


def test_from_python_one_name_is_one_name(monkeypatch, tmp_path):
    given = []
    monkeypatch.setattr("shiplog.commands.train.train_command", lambda *a: given.append(a[-1]))
    monkeypatch.setattr("shiplog.training.runs.load_model.load", lambda path: path)
    shiplog.train("store", tmp_path / "r", without="wind", free="hull.*", voyages="trip_1")
    (options,) = given
    assert (options.without, options.free, options.voyages) == (("wind",), ("hull.*",), ("trip_1",))
    with pytest.raises(ShiplogError, match=r"mine\.py is no Python file"):  # and not "m"
        shiplog.diagnose("r", "store", causes="mine.py")
