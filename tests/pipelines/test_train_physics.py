"""`shiplog train --model mmg` and `hybrid` as a user types them, on short voyages."""

import json
import math
import shutil
import tomllib
from datetime import UTC, datetime
from importlib import resources

import numpy as np
import polars as pl
import pytest
import sailing
from commands import call
from own_causes import GOOD
from safetensors.numpy import load_file, save_file

from pipelines.experiments import simulated_ship
from pipelines.identify import identify_run
from shiplog.exceptions import RunError
from shiplog.models.causes import CATALOGUE, user
from shiplog.training import extension_file, load_model, regularisation
from shiplog.training import output_error as identification
from shiplog.training.run_config import Config
from shiplog.voyages.ingest import ingest
from shiplog.voyages.split import choose_physical_split
from shiplog.voyages.split_settings import Split
from shiplog.voyages.store import Store

HULL = ("--without", "propeller", "--without", "rudder")  # a hull in the wind compiles quickly
WINDOW = ("--window", 25)
BOTH = ("--voyages", "trip_1", "--voyages", "trip_2")
STATES = ["x0", "surge", "y0", "sway", "heading", "yaw_rate"]


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Three short voyages of the simulated ship, all on one day."""
    folder = tmp_path_factory.mktemp("logs")
    for number in range(1, 4):
        voyage = simulated_ship.sail(80.0, seed=number, wind=simulated_ship.Wind(3.0, number))
        start = datetime(2026, 5, 1, 10 + number, 0, tzinfo=UTC)
        simulated_ship.write_voyage(
            folder / f"trip_{number}.mcap", voyage, seed=number, start=start
        )
    return folder


@pytest.fixture(scope="module")
def store(logs, tmp_path_factory):
    path = tmp_path_factory.mktemp("work") / "store"
    assert call("ingest", logs, "--store", path)[0] == 0
    return path


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


def train(store, out, *arguments):
    return call("train", "--store", store, "--out", out, *WINDOW, *arguments)


def answer(path):
    return json.loads(path.read_text(encoding="utf-8"))


def scored(run, store, to) -> dict:
    assert call("evaluate", run, "--store", store, "--voyages", "trip_3", "--json", to)[0] == 0
    return answer(to)


@pytest.fixture(scope="module")
def published(store):
    """Nothing fitted: run folder and what was reported of it."""
    out = store.parent / "published"
    code, reported, _ = train(store, out, "--model", "mmg", "--no-fit", *BOTH, *HULL)
    assert code == 0
    return out, reported


@pytest.fixture(scope="module")
def fitted(store):
    """All of hull and wind identified, three seeds asked for: run folder, text and JSON."""
    out, to = store.parent / "fitted", store.parent / "fitted.json"
    code, reported, _ = train(
        store, out, "--model", "mmg", *BOTH, *HULL, "--seeds", 3, "--json", to
    )
    assert code == 0
    return out, reported, answer(to)


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


def test_a_run_made_before_linear_damping_simulates_what_it_did(published, tmp_path):
    """Its folder holds neither names nor numbers of the five coefficients."""
    old = tmp_path / "old"
    shutil.copytree(published[0], old)
    table = load_model.load(old).identified()
    late = table["name"].is_in([f"hull.{key}" for key in ("x_u", "y_vl", "y_rl", "n_vl", "n_rl")])
    assert late.sum() == 5
    table.filter(~late).write_parquet(old / "seed0" / "identified.parquet")
    arrays = load_file(old / "seed0" / "model.safetensors")
    had = ~late.to_numpy()
    arrays |= {"theta": arrays["theta"][had], "covariance": arrays["covariance"][had][:, had]}
    save_file(
        {k: np.ascontiguousarray(v) for k, v in arrays.items()}, old / "seed0" / "model.safetensors"
    )
    now, was = load_model.load(published[0]), load_model.load(old)
    assert was.simulator(0).theta.tolist() == now.simulator(0).theta.tolist()
    start = was.base()[1]
    assert start.spread[late.to_numpy()].tolist() == [1e-9] * 5
    assert start.spread[had].tolist() == now.base()[1].spread[had].tolist()


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


# ---------------------------------------------------------------- identified


def test_the_answer_says_what_was_found(fitted):
    run, reported, content = fitted
    assert set(content) == {"contract", "run", "label", "windows", "notes", "parameters", "split"}
    assert content["contract"] == 1 and content["windows"] == 6
    assert content["label"] == "mmg identified on ref, without propeller, rudder"
    assert len(content["parameters"]) == 3 + 15 + 10
    first = content["parameters"][0]
    assert set(first) == {"name", "symbol", "meaning", "unit", "start", "spread", "value",
                          "standard_error", "free"}  # fmt: skip
    assert first["name"] == "body.m_x" and first["symbol"] == "m'_x"
    assert content["split"]["training"] == ["trip_1", "trip_2"]
    assert any("held-out voyages" in s for s in content["notes"])
    assert f"Next: shiplog evaluate {run}" in reported and "| hull.y_v" in reported


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
    """Identified from one voyage, validated on another: run folder and text."""
    out = store.parent / "validated"
    code, reported, _ = train(store, out, "--model", "mmg", "--voyages", "trip_1", "--validation",
                          "trip_2", "--free", "hull.*", *HULL)  # fmt: skip
    assert code == 0
    return out, reported


def test_validation_voyages_choose_the_ridge_and_it_is_kept(validated):
    run, reported = validated
    (line,) = [s for s in reported.splitlines() if s.startswith("Ridge of ")]
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
    code, reported, _ = train(store, run, "--model", "mmg", *BOTH, "--validation", "trip_3",
                          "--free", "hull.*", *HULL)  # fmt: skip
    assert code == 0 and "Ridge of 0.25 times the plausible spreads, chosen on 3" in reported
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


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--free", "wind.y_1"), ["No parameter is called 'wind.y_1'", "did you mean 'wind.y1'"]),
        (("--free", "nonsense"), ["No parameter is called 'nonsense'", "hull.y_v", "'wind.*'"]),
        (("--free", "rudder.*"), ["No parameter is called 'rudder.*'"]),  # it was left out
        (("--without", "wing"), ["no force 'wing'", "did you mean 'wind'"]),
        (("--without", "hull"), ["no force 'hull'"]),
        (("--parameters", "nowhere.toml"), ["nowhere.toml cannot be read"]),
    ],
)
def test_a_wrong_choice_names_the_right_ones(store, tmp_path, arguments, words):
    code, _, reported = train(store, tmp_path / "r", "--model", "mmg", *BOTH, *HULL, *arguments)
    assert code == 1
    for word in words:
        assert word in reported
    assert not list(tmp_path.iterdir())


def test_a_window_longer_than_every_voyage_is_refused(store, tmp_path):
    code, _, reported = call("train", "--store", store, "--out", tmp_path / "r", "--model", "mmg",
                         "--window", 400, *BOTH, *HULL)  # fmt: skip
    assert code == 1 and "longer than every" in reported
    assert not list(tmp_path.iterdir())


def test_a_hybrid_has_to_be_fitted(store, tmp_path):
    code, _, reported = train(store, tmp_path / "r", "--model", "hybrid", "--no-fit", *BOTH)
    assert code == 2 and "has to be fitted" in reported and "--model mmg" in reported
    assert not list(tmp_path.iterdir())


def test_a_hybrid_needs_a_second_voyage(store, tmp_path):
    code, _, reported = train(store, tmp_path / "r", "--model", "hybrid", "--voyages", "trip_1",
                          "--free", "wind.*", *HULL)  # fmt: skip
    assert code == 1 and "needs a voyage to hold out" in reported and "--validation" in reported
    assert not (tmp_path / "r").exists()


def test_wind_coefficients_need_a_wind_sensor(fitted, calm, tmp_path):
    toml = fitted[0] / "seed0" / "parameters.toml"
    given = ("--model", "mmg", "--no-fit", "--parameters", toml, *BOTH, *HULL)
    code, _, reported = train(calm, tmp_path / "r", *given)
    assert code == 1 and "has a wind force" in reported and "--without wind" in reported
    assert not list(tmp_path.iterdir())
    code, reported, _ = train(calm, tmp_path / "r", *given, "--without", "wind")
    assert code == 0 and "without propeller, rudder, wind" in reported


# ---------------------------------------------------------------- the hybrid


@pytest.fixture(scope="module")
def hybrid(store):
    """A network of two units, one strength to choose; only one parameter of the physics free."""
    physics = {"without": ("propeller", "rudder", "wind"), "free": ("hull.x_0f",),
               "width": 2, "strengths": (1.0,)}  # fmt: skip
    config = Config.model_validate(
        {
            "model": "hybrid", "window": 25, "physics": physics,
            "split": Split(training=("trip_1", "trip_2"), validation=()),
        }
    )  # fmt: skip
    return identify_run(config, Store(store), store.parent / "hybrid")


def test_a_hybrid_is_judged_on_held_out_voyages_and_says_so(hybrid):
    run, reported = hybrid
    assert run.label == "hybrid identified on ref, without propeller, rudder, wind"
    (sentence,) = [s for s in reported if s.startswith("Seed 0")]
    assert "adds nothing that survives" in sentence or "on 6 held-out windows" in sentence
    assert run.band() is not None


def test_a_hybrid_is_opened_as_it_was_fitted(hybrid, store, tmp_path):
    run, _ = hybrid
    model = run.simulator(0).model
    assert model.residual.width == 2
    assert len(model.names) == 3 + 15 + model.residual.count == len(run.simulator(0).theta)
    assert model.residual.anchors.shape == (150, 6)  # two voyages of three windows of 25 s
    found = run.identified()
    assert found.height == 18 and not any("network" in name for name in found["name"])
    assert found.filter(pl.col("free"))["name"].to_list() == ["hull.x_0f"]
    held = found.filter(~pl.col("free"))
    assert (held["value"] == held["start"]).all()
    toml = tomllib.loads((run.path / "seed0" / "parameters.toml").read_text(encoding="utf-8"))
    assert set(toml) == {"source", "body", "hull"}
    content = scored(run.path, store, tmp_path / "e.json")
    assert math.isfinite(content["loss"]) and sorted(content["band_90"]) == sorted(STATES)


def test_a_damaged_model_is_named(hybrid, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(hybrid[0].path, copy)
    path = copy / "seed0" / "model.safetensors"
    path.write_bytes(path.read_bytes()[:50])
    with pytest.raises(RunError, match=r"model\.safetensors cannot be read"):
        load_model.load(copy).simulator(0)


# ---------------------------------------------------------------- the split


@pytest.fixture(scope="module")
def seven(tmp_path_factory):
    """The names of the sample logs, and one voyage more."""
    folder = tmp_path_factory.mktemp("seven")
    whole = Store(folder / "store")
    for number in range(1, 8):
        rng = np.random.default_rng(number)
        parts = sailing.series(30.0)
        for one in parts.values():
            for column, values in one.columns.items():
                one.columns[column] = values + rng.normal(0, 1e-3, len(values))
        path = sailing.write(folder / f"voyage_{number}.mcap", parts)
        whole.add(ingest(path, sailing.profile()))
    return whole


SIX = [f"voyage_{i}" for i in range(1, 7)]


def test_named_voyages_are_all_trained_on(seven):
    for named in (SIX, ["voyage_7", "voyage_2"], ["voyage_[1-6]"]):
        split = choose_physical_split(seven, named, (), "ref", 20)
        assert set(split.training) == set(seven.select(named))
        assert (split.validation, split.test) == ((), ())
        assert "held out in turn" in split.chosen_by


@pytest.mark.parametrize(("data", "count"), [("ref", 2), ("d-ref", 4)])
def test_the_sample_logs_keep_the_papers_split(seven, data, count):
    split = choose_physical_split(seven, (), (), data, 20)
    assert split.training == tuple(SIX[:count])
    assert (split.validation, split.test) == (("voyage_5",), ("voyage_6",))


def test_the_users_validation_is_kept_apart(seven):
    split = choose_physical_split(seven, ("voyage_[1-3]",), ("voyage_3", "voyage_7"), "ref", 20)
    assert split.training == ("voyage_1", "voyage_2")
    assert split.validation == ("voyage_3", "voyage_7") and split.test == ()
    rest = choose_physical_split(seven, (), ("voyage_7",), "ref", 20)
    assert rest.training == tuple(SIX) and rest.validation == ("voyage_7",)


def test_with_nothing_named_a_share_is_left_for_testing(store):
    split = choose_physical_split(Store(store), (), (), "ref", 25)
    assert split.validation == () and len(split.test) == 1
    assert sorted((*split.training, *split.test)) == ["trip_1", "trip_2", "trip_3"]
