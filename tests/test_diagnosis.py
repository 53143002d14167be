"""From logs to a verdict on the known ship, with seeds that nobody looked at before.

One campaign of the ship as it is and one with a current go the whole way through MCAP, the store
and the pipelines; what is usual for it is learnt there once. Other trials are judged against it.
"""

import json
import math
from dataclasses import replace
from importlib import resources
from types import SimpleNamespace

import afloat
import numpy as np
import pytest
import sailing

from pipelines import diagnose as pipeline
from pipelines.diagnosis.held_out import HeldOut
from pipelines.diagnosis.trial import record_of
from pipelines.identify import identify_run
from pipelines.known_ship import Laws, cases, sensors
from pipelines.prepare import ingest_logs
from pipelines.split import choose_physical_split
from shiplog import (
    advise,
    conventions,
    diagnose,
    evidence,
    linearise,
    reading,
    record,
    reference,
    runs,
    segments,
    structure,
    timescale,
    unnamed,
)
from shiplog import decision as decisions
from shiplog import profile as profiles
from shiplog.causes.sensors import HeadingOffset
from shiplog.config import Config, Physics
from shiplog.exceptions import RunError
from shiplog.gain import Gain
from shiplog.hypotheses import Found, Told, Trial
from shiplog.ingest import ingest
from shiplog.settling import settle, within
from shiplog.store import Store
from shiplog.verdict import limits_json, ranking_json, sentence

SEED = 7101
PROFILE = profiles.load("esso-vectwin")
NOMINAL = ("nominal_1", "nominal_3", "nominal_5", "nominal_6")  # 3400 s
TIDE = """
import jax.numpy as jnp
from shiplog.causes import Cause, Parameter


class Tide(Cause):
    name = "far_tether"
    kind = "environment"
    story = "A long line pulls it."
    equation = "X₀ = {north:.2f} N, Y₀ = {east:.2f} N along the earth's axes"
    parameters = (Parameter("north", "N", 1.0, 0.1), Parameter("east", "N", 1.0, 0.1))

    def force(self, p, state, at):
        c, s = jnp.cos(state[..., 4]), jnp.sin(state[..., 4])
        return jnp.stack((c * p[0] + s * p[1], c * p[1] - s * p[0], 0.0 * c), -1)
"""


def hidden(cause: str, size: float = 1.0, **changes) -> cases.Case:
    """This ship with something hidden for 500 s, two voyages; `changes` to what is hidden.

    Under the sample logs' laws: thresholds here are of the program, with a ship that it can fit.
    """
    case = cases.draw(SEED, cause=cause, size=size, seconds=500)
    return replace(case, laws=Laws(), effects=replace(case.effects, **changes))


def log(case: cases.Case, leg: cases.Leg, folder):
    path = folder / f"{leg.name}.mcap"
    sensors.write_voyage(path, cases.voyage(case, leg), seed=leg.seed, start=leg.start)
    return path


pytestmark = pytest.mark.former


@pytest.fixture(scope="module")
def sea(tmp_path_factory):
    """The whole way, once: run, store, what is usual, the diagnosis of a trial with a current."""
    work = tmp_path_factory.mktemp("sea")
    (work / "logs").mkdir()
    case = hidden("current", size=2.3)  # 0.14 m/s
    paths = [log(case, leg, work / "logs") for leg in case.nominal if leg.name in NOMINAL]
    paths += [log(case, leg, work / "logs") for leg in case.trial]
    short = replace(case.trial[0], name="short", seconds=100.0)
    paths.append(log(hidden("none"), short, work / "logs"))
    store = Store(work / "store")
    assert not ingest_logs(paths, "esso-vectwin", store).refused
    split = choose_physical_split(store, ("nominal_*",), (), "ref", 100)
    config = Config(model="mmg", split=split, physics=Physics(folds=2))
    run, _ = identify_run(config, store, work / "mmg")
    (work / "tide.py").write_text(TIDE, encoding="utf-8")
    done = pipeline.diagnose_run(
        run.path, store, ["trial_*"], work / "out", extend=work / "extended",
        cause_files=[work / "tide.py"],
    )  # fmt: skip
    return SimpleNamespace(
        work=work, store=store, run=run, done=done, case=case, usual=done.trial.reference
    )


def judged(usual, seen, numbers=None, fixed=()):
    trial = Trial(usual, seen, tuple(fixed))
    point = trial.at(numbers or {})
    trial.robust(point)
    return trial, diagnose.decide(trial, point)


def labels(decision) -> list[str]:
    return [n.cause.label for n in decision.named]


def truth(case) -> dict:
    return {k: v["value"] for k, v in case.causes[0].parameters.items()}


def apart(a: float, b: float) -> float:
    """Between two directions [deg]."""
    return abs((a - b + 180.0) % 360.0 - 180.0)


@pytest.fixture(scope="module")
def trials(sea, tmp_path_factory):
    """Cause → record of a trial with it hidden."""
    kept = {}

    def of(cause: str, **changes):
        key = (cause, *sorted(changes.items()))
        if key not in kept:
            case = hidden(cause, **changes)
            folder = tmp_path_factory.mktemp("trial")
            made = [ingest(log(case, leg, folder), PROFILE) for leg in case.trial]
            kept[key] = record.read([v.table for v in made], [v.name for v in made], PROFILE)
        return kept[key]

    return of


@pytest.fixture(scope="module")
def still(sea, trials):
    return judged(sea.usual, trials("none"))


@pytest.fixture(scope="module")
def compass(sea, trials):
    return judged(sea.usual, trials("heading_offset"))


# --- the whole way


def test_a_current_is_named_and_sized(sea):
    (named,) = sea.done.decision.named
    shown, true = named.shown, truth(sea.case)
    assert sea.done.verdict.verdict == "named"
    assert named.cause.label == "current"
    assert named.probability > 0.9
    assert shown["speed"].value == pytest.approx(true["speed"], rel=0.05)
    assert apart(shown["direction"].value, true["direction"]) < 3.0
    gain = sea.done.verdict.gain
    assert gain.real and gain.reduction > 0.5
    assert gain.windows == len(sea.done.held.cut)


def test_the_extended_model_has_nothing_more_wrong(sea):
    """Diagnosed again on the very same voyages: none; and its rollouts are better."""
    again = runs.load(sea.work / "extended")
    numbers = again.extension_numbers()
    assert list(numbers) == ["current"]
    _, decision = judged(sea.usual, sea.done.trial.record, numbers, tuple(numbers))
    assert (decision.verdict, labels(decision)) == ("none", [])
    extended = again.models()[0]
    after = extended.losses(sea.done.held.cut).mean()
    before = sea.done.held.before.losses(sea.done.held.cut).mean()
    assert after < 0.5 * before
    assert after == pytest.approx(sea.done.after.losses(sea.done.held.cut).mean(), rel=1e-9)


CAUSES = (
    "current", "wind_force", "shallow_water", "bank", "fouling", "payload", "cross_flow_drag",
    "thrust_loss", "thrust_drift", "rudder_force", "rudder_offset", "rudder_lag",
    "rudder_delay", "side_thrust", "heading_offset", "yaw_rate_bias", "yaw_rate_scale",
    "clock_offset", "antenna_offset", "wind_direction_offset", "wind_speed_scale", "coverage",
    "external", "unknown",
)  # fmt: skip
FAMILIES = ("position", "heading", "time", "motion", "controls", "wind", "stochastic")


def shaped(v: dict) -> None:
    """The contract's section 5, as other programs rely on it."""
    assert v["contract"] == 1
    assert v["verdict"] in ("named", "none", "unknown", "undecided", "coverage", "external")
    assert (v["verdict"] == "named") == bool(v["causes"])
    for cause in v["causes"]:
        assert cause["name"] in CAUSES or cause.get("user")
        assert 0.0 <= cause["probability"] <= 1.0
        assert cause["sentence"] and cause["equation"]
        assert isinstance(cause["indistinguishable_from"], list)
        for one in cause["parameters"].values():
            assert {"value", "low", "high", "unit"} <= set(one)
            assert one["low"] <= one["value"] <= one["high"]
    for key in ("ranking", "rejected", "traces", "wrong", "intervals"):
        assert isinstance(v[key], list)
    for one in v["ranking"]:
        assert 0.0 <= one["probability"] <= 1.0
    for one in v["rejected"]:
        assert one["name"] and one["reason"]
    for one in v["wrong"]:
        assert {"channel", "share_of_error", "where"} <= set(one)
    if v["verdict"] == "unknown":
        assert v["structure"]["family"] in FAMILIES
    if (gain := v.get("gain")) is not None:
        assert {"before", "after", "reduction", "low", "high", "held_out_windows"} <= set(gain)
        assert gain["low"] <= gain["reduction"] <= gain["high"]
    assert set(v["base"]) >= {"run", "before_effect"}


def test_the_answer_has_the_shape_of_the_contract(sea):
    told = json.loads((sea.work / "out" / "verdict.json").read_text("utf-8"))
    shaped(told)
    assert told["causes"][0]["name"] == "current"
    assert set(told["causes"][0]["parameters"]) == {"speed", "direction"}
    assert told["base"] == {"run": "mmg", "before_effect": True}
    assert sum(one["probability"] for one in told["ranking"]) == pytest.approx(1.0, abs=0.05)
    report = (sea.work / "out" / "report.md").read_text("utf-8")
    assert "steady current" in report and "Gain" in report


def test_too_little_is_said_and_nothing_named(sea):
    done = pipeline.diagnose_run(sea.run.path, sea.store, ["short"], sea.work / "short")
    told = json.loads((sea.work / "short" / "verdict.json").read_text("utf-8"))
    shaped(told)
    assert done.verdict.verdict == "coverage" and told["causes"] == []
    assert "Too little" in told["sentence"] and "100 s" in told["sentence"]


def test_a_model_without_a_path_is_a_verdict(sea, monkeypatch):
    """Whatever the numerics do ends as an answer: nothing is named and nothing raised."""

    def singular(*_):
        raise np.linalg.LinAlgError("Matrix is not positive definite")

    monkeypatch.setattr(pipeline.setup, "trial_of", singular)
    done = pipeline.diagnose_run(sea.run.path, sea.store, ["trial_1"], sea.work / "away")
    told = json.loads((sea.work / "away" / "verdict.json").read_text("utf-8"))
    shaped(told)
    assert (done.verdict.verdict, told["causes"]) == ("undecided", [])
    assert "runs away" in told["sentence"] and "evaluate" in told["sentence"]


def test_voyages_of_another_ship_are_refused(sea, tmp_path):
    log_ = sailing.write(tmp_path / "other.mcap")
    (tmp_path / "circle.toml").write_text(sailing.PROFILE, encoding="utf-8")
    store = Store(tmp_path / "store")
    assert not ingest_logs([log_], str(tmp_path / "circle.toml"), store).refused
    with pytest.raises(RunError, match="'circle'"):
        pipeline.diagnose_run(sea.run.path, store, ["other"], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_without_wind_sensor_what_needs_it_is_not_tested(tmp_path):
    """A model that nothing was fitted to, on another voyage of that season: it has absorbed
    nothing, so that all else is tested. A hull alone compiles quickly."""
    text = (resources.files("shiplog") / "profiles" / "esso-vectwin.toml").read_text("utf-8")
    begin = text.index("[sensors.wind]")
    profile = tmp_path / "calm.toml"
    profile.write_text(text[:begin] + text[text.index("[[actuators]]") :], encoding="utf-8")
    case = hidden("none")
    store = Store(tmp_path / "store")
    assert not ingest_logs([log(case, leg, tmp_path) for leg in case.trial], str(profile),
                           store).refused  # fmt: skip
    split = choose_physical_split(store, ("trial_1",), (), "ref", 100)
    physics = Physics(fit=False, without=("propeller", "rudder"))
    run, _ = identify_run(Config(model="mmg", split=split, physics=physics), store, tmp_path / "r")
    done = pipeline.diagnose_run(run.path, store, ["trial_2"], tmp_path / "out")
    told = done.verdict.as_json()
    shaped(told)
    assert told["base"] == {"run": "r", "before_effect": False}
    why = {one["name"]: one["reason"] for one in told["unavailable"]}
    for name in ("wind_force", "wind_direction_offset", "wind_speed_scale"):
        assert "no wind is recorded" in why[name]
    tested = {c.label for c in done.trial.reference.model.causes}
    assert tested >= {"current", "clock_offset:gnss", "fouling", "payload"}
    assert not tested & {"wind_force", "clock_offset:wind", "wind_speed_scale"}
    assert not any(one["name"] == "unknown:wind" for one in told["ranking"])


def test_a_model_that_simulates_nothing_names_nothing(sea):
    """Worse than keeping all velocities, with what was named in it too."""
    held = sea.done.held
    assert held.lost(sea.done.verdict.gain) == ""
    away = replace(sea.done.verdict.gain, after=1e8)  # with what is named in it, it runs away
    assert held.lost(away) == ""
    theta = held.before.theta.copy()
    theta[
        list(held.before.model.names).index("hull.x_0f")
    ] *= -200.0  # drives it instead of braking
    wild = HeldOut(held.cut, replace(held.before, theta=theta), held.trial)
    said = wild.lost(None)
    assert "worse than one that keeps its velocities" in said


@pytest.mark.parametrize(
    "said", ("the rudder's sign turned round", "the two rudders exchanged",
             "the propeller's sign turned round", "the wind blowing towards"),
)  # fmt: skip
def test_a_sign_that_is_the_other_way_round_is_found(sea, said):
    """Each is its own inverse: turned back, the model is as good as it was. Its current is in it:
    what a wrong sign does must not drown in what else is wrong."""
    cut, model = sea.done.held.cut, sea.done.after
    (turned,) = [w for s, w in conventions.other(PROFILE, cut) if said in s]
    found, loss = conventions.best(model, turned)
    assert said in found
    assert loss == pytest.approx(model.losses(cut).mean(), rel=1e-4)
    told = HeldOut(turned, model, sea.done.trial).lost(None)
    if "sign" in said:  # the others do not double the error of so short a trial
        assert said in told and f"L is {loss:.0f}" in told
    assert HeldOut(cut, model, sea.done.trial).lost(None) == ""


@pytest.mark.parametrize(
    ("label", "evidence", "after", "low", "left"),
    [
        ("current", 60.0, 480.0, -0.01, 1),  # strong evidence, a gain that is not sure
        ("current", 12.0, 480.0, 0.01, 1),  # weak evidence, a sure gain
        ("current", 12.0, 480.0, -0.01, 0),  # neither: it may be something like it
        ("current", 60.0, 505.0, -0.01, 0),  # no gain at all
        ("current", 61.0, 505.0, -0.01, 1),  # nor a loss that is sure, and it is there for sure
        ("current", 61.0, 610.0, -0.01, 0),  # which does harm
        ("yaw_rate_bias", 12.0, 505.0, -0.01, 1),  # an instrument's fault, worth nothing
        ("yaw_rate_bias", 60.0, 700.0, -0.6, 0),  # which does harm
    ],
)
def test_what_does_not_gain_is_no_cause_of_the_error(sea, label, evidence, after, low, left):
    cause = next(c for c in sea.usual.model.causes if c.label == label)
    one = replace(sea.done.decision.named[0], cause=cause, evidence=evidence)
    point = replace(sea.done.decision.base, numbers={label: np.zeros(cause.count)})
    decision = replace(sea.done.decision, named=(one,), base=point)

    class Said(HeldOut):
        def gain(self, decided):
            return Gain(500.0, after if decided.named else 500.0, low, 0.1, 18, {})

        def worth(self, rest, decided):
            assert not rest.named
            return self.gain(decided)

    held = sea.done.held
    rest, found, dropped = Said(held.cut, held.before, held.trial).refuted(decision)
    assert len(rest.named) == left and (found is None) == (not left)
    assert ("no gain on held-out voyages" in dropped.get(label, "")) == (not left)


@pytest.mark.parametrize(
    ("evidence", "after", "left"),
    [
        (61.0, 480.0, 1),  # beyond doubt, and each half is told by the others
        (61.0, 610.0, 0),  # and is not
        (60.0, 480.0, 0),  # not beyond doubt
    ],
)
def test_what_one_of_two_voyages_shows_is_asked_by_their_halves(sea, evidence, after, left):
    """The other voyage never came near the bank: without the first nobody knows how it draws."""
    first = replace(sea.done.decision.named[0], evidence=evidence)
    decision = replace(sea.done.decision, named=(first,))

    class Said(HeldOut):
        def gain(self, decided):
            harms = decided.named and not decided.halves
            return Gain(500.0, 765.0 if harms else after, -0.6 if harms else -0.05, 0.1, 4, {})

        def worth(self, rest, decided):
            return self.gain(decided)

    held = sea.done.held
    assert len(set(held.voyages)) == 2
    rest, found, dropped = Said(held.cut, held.before, held.trial).refuted(decision)
    assert len(rest.named) == left and set(dropped) == ({"current"} if not left else set())
    if left:
        assert rest.halves and found.after == after


def test_halves_of_voyages_are_left_out_one_by_one(sea):
    """Each window once, and of its voyage no row of the same half in the numbers."""
    held = sea.done.held
    folds = list(held._folds(True))
    assert [(name, half[1]) for name, half, _ in folds] == [
        (name, late) for name in dict.fromkeys(held.voyages) for late in (False, True)
    ]
    rows = np.concatenate([rows.numpy() for _, _, rows in folds])
    assert sorted(rows) == list(range(len(held.voyages)))
    size = float(held.cut.dt[0].sum())
    for name, (middle, late), rows in folds:
        for row in held.cut.plan[rows.numpy()].to_dicts():
            assert row["voyage"] == name
            inside = (row["elapsed"], row["elapsed"] + size)
            assert min(inside) >= middle - 1.0 if late else max(inside) <= middle + 1.0
    assert [half for _, half, _ in held._folds(False)] == [None, None]
    said = [held.left_out(replace(sea.done.decision, halves=h)) for h in (False, True)]
    assert said == ["its voyage", "its half of the voyage"]
    alone = HeldOut(held.cut.pick(folds[0][2]), held.before, held.trial)
    assert alone.left_out(sea.done.decision) == said[1]


@pytest.mark.parametrize(
    ("evidence", "high", "left"),
    [
        (121.0, 0.03, 2),  # beyond doubt, and it may be worth something
        (121.0, 0.01, 1),  # and it is not
        (119.0, 0.03, 1),  # not beyond doubt
    ],
)
def test_a_second_cause_that_is_refuted_takes_along_what_it_beat(sea, evidence, high, left):
    """What explains far less than a cause that does not gain is not named in its stead."""
    first = sea.done.decision.named[0]
    cause = next(c for c in sea.usual.model.causes if c.label == "thrust_loss")
    second = replace(
        first, cause=cause, evidence=evidence,
        beaten={"thrust_drift": 45.0, "payload": 12.0, "current": 45.0},
    )  # fmt: skip
    numbers = {**sea.done.decision.base.numbers, "thrust_loss": np.zeros(1)}
    decision = replace(
        sea.done.decision,
        named=(first, second),
        base=replace(sea.done.decision.base, numbers=numbers),
    )

    class Said(HeldOut):
        def worth(self, rest, decided):
            if labels(rest) != ["current"]:
                return Gain(900.0, 500.0, 0.3, 0.5, 18, {})
            return Gain(500.0, 505.0, -0.04, high, 18, {})

    held = sea.done.held
    rest, _, dropped = Said(held.cut, held.before, held.trial).refuted(decision)
    assert len(rest.named) == left
    assert set(dropped) == (set() if left == 2 else {"thrust_loss", "thrust_drift"})
    assert left == 2 or "explains 45 nats more" in dropped["thrust_drift"]


def test_what_it_may_be_instead_is_in_the_sentence():
    """A name alone would say more than is known; and a gain below nothing is a loss."""
    lag = {
        "sentence": "The rudders lag.", "indistinguishable_from": ["rudder_delay"],
        "probability": 0.9,
    }  # fmt: skip
    said = sentence("named", [lag], None, Gain(500.0, 510.0, -0.05, 0.01, 18, {}), 1.0)
    assert said == (
        "No part of the error on 18 held-out windows is surely explained: it is 2.0% more (5.0% "
        "more to 1.0% less). The rudders lag; or it is rudder_delay: these data cannot tell."
    )
    sure = lag | {"indistinguishable_from": []}
    gained = Gain(500.0, 400.0, 0.1, 0.3, 18, {})
    assert sentence("named", [sure], None, gained, 1.0) == (
        "20% of the error on 18 held-out windows is explained (10% to 30%). The rudders lag."
    )
    for probability, begins in ((0.53, "Likely, and not surely (53%): "), (0.4, "Perhaps, and ")):
        said = sentence("named", [sure | {"probability": probability}], None, gained, 1.0)
        assert f"(10% to 30%). {begins}" in said and said.endswith("The rudders lag.")


def test_the_largest_part_that_is_not_explained_is_in_the_sentence():
    """Of shares 0.6 and 0.3 before: nine tenths of the first are taken off, a third of the second,
    so that 0.06 and 0.2 are left."""
    sure = {"sentence": "The rudders lag.", "indistinguishable_from": [], "probability": 1.0}
    gained = Gain(500.0, 200.0, 0.5, 0.7, 18, {"sway": 0.9, "yaw_rate": 1.0 / 3.0})
    wrong = [
        {"channel": "sway", "share_of_error": 0.6}, {"channel": "yaw_rate", "share_of_error": 0.3},
    ]  # fmt: skip
    assert sentence("named", [sure], None, gained, 1.0, wrong=wrong).endswith(
        "The rudders lag. The largest part that is not is in yaw rate: 20% of the error."
    )


def test_what_another_fit_brings_alone_is_in_the_sentence():
    sure = {"sentence": "The wind is late.", "indistinguishable_from": [], "probability": 1.0}
    gained = Gain(500.0, 300.0, 0.3, 0.5, 18, {})
    assert sentence("named", [sure], None, gained, 1.0, 0.32).endswith(
        "(30% to 50%). The wind is late. Fitted again with nothing named, the model has an error "
        "32.0% less."
    )
    assert sentence("named", [sure], None, gained, 1.0, -0.1).endswith("has an error 10.0% more.")


def test_the_manoeuvre_that_separates_is_the_seamans(sea):
    """Rudders must move to tell a lag from a delay, screws turn to tell lost thrust from a rough
    hull, and the ship swing both ways to tell a gyro's scale from its bias."""
    trial = sea.done.trial
    grams = dict(
        zip((m.said(1.0) for m in advise.MANOEUVRES), advise.sailed(trial, {}), strict=True)
    )
    by = {c.label: c for c in sea.usual.model.causes}

    def worth(label, numbers, other):
        one = replace(sea.done.decision.named[0], cause=by[label], numbers=np.array(numbers))
        return {w.split(",")[0]: advise.apart(trial, g, one, other) for w, g in grams.items()}

    lag = worth("rudder_lag", [2.0], "rudder_delay")
    assert lag["a drifting stop"] == pytest.approx(0.0, abs=1e-3)
    assert lag["doublets of 3 s at constant revolutions"] > 5.0
    power = worth("thrust_loss", [-0.2], "fouling")
    assert power["full power and no power in turn"] > 1.5 * power["a drifting stop"]
    gyro = worth("yaw_rate_scale", [0.03], "yaw_rate_bias")
    assert gyro["a zigzag"] > 10.0 * gyro["a drifting stop"]
    assert all(v >= -1e-6 for found in (lag, power, gyro) for v in found.values())


@pytest.mark.parametrize(("second", "said"), [(95.0, "unknown"), (105.0, "named")])
def test_two_causes_are_no_structure_though_one_explains_less(compass, monkeypatch, second, said):
    trial, decision = compass
    found = decision.named[0].evidence
    told = iter([found + 100.0, -20.0, -20.0])
    monkeypatch.setattr(
        unnamed.Structures, "found", lambda *_: [Found("controls", next(told), 1.0)]
    )
    monkeypatch.setattr(unnamed.Structures, "acts_on", lambda *_: ("sway",))
    monkeypatch.setattr(diagnose._Search, "_second", lambda *_: second)
    again = diagnose.decide(trial, decision.first)
    assert (again.verdict, labels(again)) == (said, ["heading_offset"] * (said == "named"))
    if said == "named":
        assert again.named[0].probability > 0.9


def test_a_second_cause_counts_where_it_would_be_taken(compass, sea):
    """Beside the heading offset nothing is hidden in the one trial; in the other a current is."""
    trial, decision = compass
    search = diagnose._Search(trial, decision.first, ())
    assert search._second(decision.point, decision.base) == 0.0
    both = Trial(sea.usual, sea.done.trial.record)
    point = both.begin({})
    _, found = both.scan(point, search.catalogue)
    first = next(f for f in found if f.name == "heading_offset")
    at, settled = settle(both, (first.name,), first.numbers, point.path)
    assert diagnose._Search(both, point, ())._second(at, settled) > diagnose.FURTHER


@pytest.mark.parametrize(
    ("louder", "gain", "counts"), [(2.0, 41.0, 41.0), (2.0, 39.0, 0.0), (1.3, 41.0, 0.0)]
)
def test_an_unrecorded_thruster_is_a_second_cause(compass, monkeypatch, louder, gain, counts):
    """Where there is unrest that it may explain, and it explains enough."""
    trial, decision = compass
    search = diagnose._Search(trial, decision.first, ())
    found = unnamed.Pulses(0.0, gain, 0.0, 1.0, np.array([0.0, 0.01, 0.0]))
    monkeypatch.setattr(unnamed, "pulses", lambda *_: found)
    assert search._second(decision.point, replace(decision.base, louder=louder)) == counts
    search.pulses = found  # there is one already
    assert search._second(decision.point, replace(decision.base, louder=louder)) == 0.0


def test_an_unrecorded_thruster_is_placed_where_it_stands(monkeypatch):
    """Its place [m ahead of midship] and force between those that are tried first, from products
    drawn with it: sway and yaw rate pushed together."""
    rng = np.random.default_rng(5)
    ship, coefficients = afloat.MODEL, dict(zip(afloat.MODEL.names, afloat.THETA, strict=True))
    unit = unnamed.accelerations(ship, coefficients, np.array([[0.0, 1.0, 1.1]]))[0]
    knots, count = 16, 300
    unrest = replace(afloat.UNREST, pulse=1.7 * unit)
    z = np.eye(6 + 3 * knots)[None].repeat(count, 0)  # all of it seen, as well as a knot can be
    drawn = np.zeros((count, 6 + 3 * knots, 1))
    drawn[:, 6:, 0] = rng.multivariate_normal(np.zeros(3 * knots), unrest.kernel(knots), count)
    sure = 1e12
    weighed = evidence.Weighed(
        sure * np.swapaxes(drawn, 1, 2) @ drawn, sure * drawn, sure * z, 0.0, knots
    )
    trial = SimpleNamespace(
        reference=SimpleNamespace(
            model=SimpleNamespace(stand_in=ship), coefficients=coefficients,
            setting=SimpleNamespace(scale={"length": 3.0}), counts=1.0,
        ),
        unrest=replace(unrest, pulse=np.array([9.0, 9.0, 9.0])),  # an earlier one is no matter
        weight=np.ones(count),
        left=lambda *_: (linear, np.zeros(0)),
        solved=lambda *_: np.zeros(0),
    )  # fmt: skip
    cut = segments.Cut(
        np.arange(count), np.zeros((count, 1, 6)), np.ones((count, 1, 6), dtype=bool),
        np.zeros((count, 1, 1)), np.zeros(count), 0.2,
    )  # fmt: skip
    path = linearise.Path(np.zeros((count, 6)), np.zeros((count, 3, knots)))
    linear = linearise.Linear(
        cut, path, np.zeros((count, 1, 6)), np.zeros((count, 1, 6, 6 + 3 * knots)),
        np.zeros((count, 1, 6, 0)),
    )  # fmt: skip
    monkeypatch.setattr(evidence, "weighed", lambda *_: weighed)
    found = unnamed.pulses(trial, SimpleNamespace(linear=linear), None)
    assert found.lever == pytest.approx(1.1, abs=0.05)
    assert found.force == pytest.approx(1.7, rel=0.1)
    assert found.gain > 1000.0


def test_a_path_may_follow_a_force_that_comes_and_goes(sea):
    """By as much as the unrest and it together may push, twice."""
    ref, pulse = sea.usual, np.array([0.0, 0.02, 0.01])
    plain, pulsed = ref.held(1.5), ref.held(1.5, pulse)
    assert pulsed.push**2 == pytest.approx(plain.push**2 + (2.0 * pulse) ** 2)


def test_beside_an_unrecorded_thruster_no_load_is_looked_for(compass):
    trial, decision = compass
    search = diagnose._Search(trial, decision.first, ())
    assert "payload" in [c.label for c in search._left(())]
    search.pulses = unnamed.Pulses(0.0, 900.0, 0.0, 1.0, np.array([0.0, 0.01, 0.0]))
    assert "payload" not in [c.label for c in search._left(())]


@pytest.mark.parametrize(
    ("as_good", "little", "said"),
    [(1.0, 1.0, "none"), (-2.0, 1.0, "none"), (-4.0, 1.0, "named"), (-2.0, -1.0, "unknown")],
)
def test_not_much_evidence_that_a_structure_has_too_names_nothing(
    compass, monkeypatch, as_good, little, said
):
    """No more for the cause than for the structure: nothing where it is little, else unknown."""
    trial, decision = compass
    found = decision.named[0].evidence
    monkeypatch.setattr(diagnose, "MORE", found + little)
    monkeypatch.setattr(diagnose, "FAINT", found + 1.0)
    monkeypatch.setattr(diagnose, "UNKNOWN", found + 10.0)
    monkeypatch.setattr(diagnose, "STOCHASTIC", np.inf)
    told = iter([found + as_good, -20.0])
    monkeypatch.setattr(
        unnamed.Structures, "found", lambda *_: [Found("controls", next(told), 1.0)]
    )
    monkeypatch.setattr(unnamed.Structures, "acts_on", lambda *_: ("sway",))
    again = diagnose.decide(trial, decision.first)
    assert again.verdict == said
    assert (again.structure is not None) == (said == "unknown")
    assert ("explains" in again.rejected.get("heading_offset", "")) == (said != "named")
    if said == "unknown":
        assert again.ranking["unknown:controls"] > again.ranking["heading_offset"] > 0.0


def test_a_side_force_of_the_screw_is_not_called_a_rudder_aslant(sea, trials):
    """A tenth of the thrust to starboard is no cause of the catalogue, and looks much like one."""
    _, decision = judged(sea.usual, trials("none", propeller_side_force=0.1))
    assert decision.verdict == "unknown" and not decision.named
    assert decision.structure.family == "controls" and "sway" in decision.structure.acts_on
    assert "rudder_offset" in decision.rejected


@pytest.mark.parametrize(
    ("nats", "rough", "joins"),
    [(29.0, False, False), (31.0, False, True), (59.0, True, False), (61.0, True, True)],
)
def test_small_evidence_follows_large_ones_about_and_names_nothing(
    compass, monkeypatch, nats, rough, joins
):
    """More of it, where the form of what was named is a rough one."""
    trial, decision = compass
    monkeypatch.setattr(HeadingOffset, "rough", rough)
    monkeypatch.setattr(unnamed.Structures, "found", lambda *_: [])
    search = diagnose._Search(trial, decision.first, ())
    assert search.one_more() and search.included == ("heading_offset",)
    numbers = {**search.base.numbers, "current": np.zeros(2)}
    more = replace(
        search.base, name="heading_offset+current", evidence=search.base.evidence + nats,
        numbers=numbers,
    )  # fmt: skip
    monkeypatch.setattr(diagnose, "_settle", lambda *_: [(search.point, more)])
    assert search.one_more() == joins
    assert ("current" in search.included) == joins


@pytest.mark.parametrize("loss", [4.0, 6.0])
def test_what_is_not_missed_leaves_evidence_and_probability_to_what_explains_it(
    compass, monkeypatch, loss
):
    """Of a current of 90 nats all but 4 are explained by what was named after it."""
    trial, decision = compass
    search = diagnose._Search(trial, decision.first, ())
    search.included = ("current", "heading_offset")
    search.steps = {"current": (90.0, {}), "heading_offset": (40.0, {})}
    search.first, search.ranking = "current", {"current": 0.9, "heading_offset": 0.1}
    both = dict.fromkeys(search.included, np.zeros(1))
    search.base = replace(search.base, evidence=1000.0, numbers=both)
    missed = {"current": 130.0, "heading_offset": loss}  # of what is left alone
    monkeypatch.setattr(
        diagnose, "settle",
        lambda _, rest, *__: (decision.first, Found(rest[0], 1000.0 - missed[rest[0]], 1.0)),
    )  # fmt: skip
    search.backwards()
    if loss == 6.0:
        assert search.included == ("current", "heading_offset") and not search.rejected
        return
    assert search.included == ("heading_offset",) and list(search.rejected) == ["current"]
    assert search.steps == {"heading_offset": (126.0, {})}
    assert search.first == "heading_offset"
    assert search.ranking == {"heading_offset": pytest.approx(1.0)}


@pytest.mark.parametrize(
    ("more", "linear", "taken"), [(3.0, 9.0, True), (1.0, 9.0, False), (3.0, 7.0, False)]
)
def test_a_cause_that_explains_more_beside_the_others_takes_the_place_of_one(
    compass, monkeypatch, more, linear, taken
):
    """A first cause of 90 nats had to explain the second one's part, too. Beside that, linearised
    once, the other one explains 9 nats where the first would be missed by 10: worth a look."""
    trial, decision = compass
    search = diagnose._Search(trial, decision.first, ())
    search.included = ("current", "heading_offset")
    search.steps = {"current": (90.0, {}), "heading_offset": (40.0, {})}
    search.first, search.ranking = "current", {"current": 0.9, "heading_offset": 0.1}
    search.rejected = {"fouling": "current explains 5 nats more"}
    none = {n: np.zeros(1) for n in ("current", "heading_offset", "fouling")}
    search.base = replace(
        search.base, evidence=1000.0, numbers={n: none[n] for n in search.included}
    )
    worth = {
        ("heading_offset",): 990.0, ("current",): 870.0, ("fouling",): 869.0,
        ("heading_offset", "fouling"): 1000.0 + more,
    }  # fmt: skip

    def rested(_, labels, *__):
        numbers = {n: none[n] for n in labels}
        return decision.first, Found("+".join(labels), worth[labels], 1.0, numbers)

    def scan(point, causes, included):
        assert included[0] not in [c.label for c in causes]
        nats = {"heading_offset": linear, "current": 20.0}.get(included[0], 0.0)
        return search.base, [Found("fouling", nats, 1.0, {"fouling": none["fouling"]})]

    monkeypatch.setattr(diagnose, "settle", rested)
    monkeypatch.setattr(trial, "scan", scan)
    search.backwards()
    if not taken:
        assert search.included == ("current", "heading_offset") and search.first == "current"
        return
    assert search.included == ("heading_offset", "fouling") and search.first == "fouling"
    assert search.ranking == {"fouling": pytest.approx(0.9), "heading_offset": 0.1}
    assert search.steps["fouling"] == (13.0, {"current": 3.0})
    assert list(search.rejected) == ["current"]


@pytest.mark.parametrize("rough", (False, True))
def test_what_a_map_leaves_of_a_shoal_is_no_thruster(compass, monkeypatch, rough):
    trial, decision = compass
    search = diagnose._Search(trial, decision.first, ())
    assert search.one_more()
    search.base = replace(search.base, louder=2.0)
    found = unnamed.Pulses(0.0, 900.0, 0.0, 1.0, np.array([0.0, 0.01, 0.0]))
    monkeypatch.setattr(unnamed, "pulses", lambda *_: found)
    monkeypatch.setattr(HeadingOffset, "rough", rough)
    monkeypatch.setattr(trial, "unrest", trial.unrest)  # as it was, after this
    assert search._pulses() != rough


def test_beside_a_thruster_none_of_its_own_motion_is_asked_and_a_cause_has_its_own_odds(
    compass, monkeypatch
):
    """The first step was the thruster's: what it left to causes is none of their probability."""
    trial, decision = compass
    monkeypatch.setattr(
        unnamed.Structures, "found",
        lambda *_: [Found("motion", 9000.0, 1.0), Found("time", -1.0, 1.0)],
    )  # fmt: skip
    search = diagnose._Search(trial, decision.first, ())
    search.pulses = unnamed.Pulses(0.0, 900.0, 0.0, 1.0, np.array([0.0, 0.01, 0.0]))
    assert search.one_more()
    assert [f.name for f in search.remains] == ["time"]
    (one,) = search.named()
    assert one.cause.label == "heading_offset" and one.probability > 0.99
    assert search.ranking["heading_offset"] < 0.01


def test_what_a_rough_form_leaves(sea):
    by = {c.label: c for c in sea.usual.model.causes}
    assert [label for label, cause in by.items() if cause.rough] == ["shallow_water", "bank"]
    assert not by["cross_flow_drag"].beside("shallow_water")
    assert by["cross_flow_drag"].beside("current") and by["payload"].beside("shallow_water")


def test_causes_settle_from_where_they_rested_before(compass):
    """From far away a second time: one linearisation, and the same rest."""
    trial, decision = compass
    (label,) = labels(decision)
    asked = []

    class Counted(Trial):
        def at(self, numbers, *given):
            asked.append(numbers)
            return super().at(numbers, *given)

    again = Counted(trial.reference, trial.record)
    point = again.begin({})
    asked.clear()
    rests = []
    for begin in (0.5, -0.5):
        _, found = settle(again, (label,), {label: np.array([begin])}, point.path)
        rests.append((len(asked), *found.numbers[label]))
        asked.clear()
    assert rests[0][0] > 2 and rests[1][0] == 1
    assert rests[0][1] == pytest.approx(rests[1][1], rel=0.02)


def test_a_number_held_at_a_bound_moves_the_others():
    """Two that go together by 0.6, of sizes that differ by a thousand: E[x | y = 0] is
    3 + 0.6 · 2 standard deviations. One that is within stays; a bound that another's move frees is
    let go: projected one by one it would stay at 0."""
    unit = np.array([1.0, 1e-3])
    covariance = np.array([[1.0, 0.6], [0.6, 1.0]]) * np.outer(unit, unit)
    low, high = np.zeros(2), np.full(2, np.inf)
    found = within(np.array([3.0, -2e-3]), covariance, low, high)
    assert found == pytest.approx([4.2, 0.0], abs=1e-9)
    inside = np.array([3.0, 2e-3])
    assert within(inside, covariance, low, high) is inside
    apart = np.array([[1.0, 0.9], [0.9, 1.0]])
    freed = within(np.array([-0.1, -2.0]), apart, low, high)
    assert freed == pytest.approx([-0.1 + 0.9 * 2.0, 0.0], abs=1e-9)


# --- a model that has learned of what is wrong


def test_a_model_that_has_learned_is_fitted_again_where_that_gains(sea, tmp_path):
    """MMG made on the very voyages that a current set. Its coefficients beside the current are
    others; held-out voyages decide which, and those of the run that is kept are those."""
    split = choose_physical_split(sea.store, ("trial_*",), (), "ref", 100)
    config = Config(model="mmg", split=split, physics=Physics(folds=2))
    run, _ = identify_run(config, sea.store, tmp_path / "mmg")
    done = pipeline.diagnose_run(run.path, sea.store, ["trial_*"], tmp_path / "out")
    held, decision = done.held, done.decision
    assert labels(decision) == ["current"]
    alone, beside = (replace(decision, adapted=a) for a in (False, True))
    either = held.gain(alone).after, held.gain(beside).after
    assert decision.adapted == (either[1] < either[0])
    assert done.verdict.gain.after == min(either) < held.adapted(beside).after

    class Better(HeldOut):
        def gain(self, decided):
            return Gain(500.0, 300.0 - 50.0 * decided.adapted + 200.0 * (not decided.named), 0.1,
                        0.5, 18, {})  # fmt: skip

        def worth(self, rest, decided):
            return self.gain(decided)

    chosen, found, _ = Better(held.cut, held.before, held.trial).refuted(alone)
    assert chosen.adapted and found.after == 250.0
    after = held.extended(chosen)
    was, now = held.before.theta, after.theta[: len(held.before.theta)]
    assert np.abs((now - was) / done.trial.reference.columns.unit[: len(was)]).max() > 0.1
    kept = runs.extend(run, tmp_path / "extended", after)
    assert kept.models()[0].losses(held.cut) == pytest.approx(after.losses(held.cut))
    assert kept.base()[1].values == pytest.approx(now)
    assert any("may have learned of what is wrong" in note for note in done.verdict.notes)


def test_of_a_network_that_has_learned_only_what_it_cannot_see_is_asked(sea):
    """What is left of a network's own inputs is a poor fit; an MMG has its forms, and no other."""
    point, ref = sea.done.decision.first, sea.usual
    cases = {
        "network": replace(ref, adapts=True, learned=True),
        "MMG": replace(ref, adapts=True),
        "before": ref,
    }
    asked = {
        name: [
            f.name for f in unnamed.Structures(Trial(one, sea.done.trial.record), point).families
        ]
        for name, one in cases.items()
    }
    assert asked["network"] == ["position", "heading", "time"]
    assert asked["MMG"] == asked["before"] == [*structure.FAMILIES, "controls"]


def test_what_a_network_learned_from_counts_for_what_its_voyages_predict_of_each_other(
    sea, monkeypatch
):
    """κ of those voyages and not a careful one; evidence is that of so much less data."""
    asked = []

    def learn(model, setting, start, record, at=None, kappa=None, *_):
        asked.append(kappa)
        return replace(sea.usual, kappa=kappa or 8.0)

    monkeypatch.setattr(reference, "learn", learn)
    monkeypatch.setattr(reference, "settled", lambda *_, **__: None)
    start = reference.Start(np.zeros(1), np.ones(1), np.zeros(1), np.ones(1))
    of = (sea.usual.model, sea.usual.setting, start, sea.done.trial.record)
    counts = [
        reference.assume(*of, given, inputs).counts
        for given, inputs in ((False, "a network"), (False, None), (True, None))
    ]
    assert counts == [1.0 / 8.0, 1.0, 1.0]
    assert asked == [None, reference.CAREFUL_KAPPA, reference.CAREFUL_KAPPA]

    point = sea.done.decision.first
    said = []
    for count, weight in ((0.25, 1.0), (1.0, 0.25)):
        trial = Trial(replace(sea.usual, counts=count), sea.done.trial.record)
        trial.first, trial.weight = point, np.full(len(trial.rows), weight)
        level = trial.level(point, 1.0, ())
        found = trial._with(level, "current")
        said.append((found.evidence - level.value, *found.numbers["current"]))
    assert said[0] == pytest.approx(said[1])


@pytest.mark.parametrize(
    ("evidence", "after", "high", "left"),
    [(60.0, 505.0, 0.005, 0), (61.0, 505.0, 0.005, 1), (61.0, 505.0, -0.005, 0),
     (61.0, 610.0, 0.005, 0)],
)  # fmt: skip
def test_what_no_function_of_a_networks_inputs_says_is_beyond_doubt(
    sea, evidence, after, high, left
):
    """Where held-out voyages cannot tell gain from loss. A loss that is sure refutes it, and harm
    does; and of a model that was fitted to all of it alone nothing is beyond doubt."""
    one = replace(sea.done.decision.named[0], evidence=evidence)
    decision = replace(sea.done.decision, named=(one,))

    class Said(HeldOut):
        def gain(self, decided):
            return Gain(500.0, after if decided.named else 500.0, -0.3, high, 18, {})

        def worth(self, rest, decided):
            return self.gain(decided)

    held = sea.done.held
    for learned in (True, False):
        seen = replace(sea.usual, adapts=True, learned=learned, nominal=None)
        trial = Trial(seen, sea.done.trial.record)
        trial.first = sea.done.trial.first
        assert len(Said(held.cut, held.before, trial).refuted(decision)[0].named) == left * learned


@pytest.mark.parametrize(("low", "left"), [(0.01, 1), (-0.01, 0)])
def test_little_evidence_beside_another_fit_is_named_where_the_gain_is_sure(sea, low, left):
    """What a model fitted again gains alone is taken off first."""
    one = replace(sea.done.decision.named[0], evidence=12.0)
    decision = replace(sea.done.decision, named=(one,))

    class Said(HeldOut):
        def gain(self, decided):
            return Gain(500.0, 400.0 - 50.0 * decided.adapted, 0.1, 0.4, 18, {})

        def worth(self, rest, decided):
            assert decided.adapted
            return Gain(400.0, 350.0, low, 0.2, 18, {})

    held = sea.done.held
    adapts = Trial(replace(sea.usual, adapts=True), sea.done.trial.record)
    adapts.first = sea.done.trial.first
    rest, _, dropped = Said(held.cut, held.before, adapts).refuted(decision)
    assert len(rest.named) == left
    assert left or "none that is sure" in dropped["current"]


# --- what is hidden, and what is not


def test_nothing_hidden_is_nothing_named(still):
    _, decision = still
    assert (decision.verdict, labels(decision)) == ("none", [])
    assert decision.pulses is None and decision.structure is None
    assert max(decision.ranking, key=decision.ranking.get) == "none"


def test_of_what_is_too_small_to_be_seen_the_size_is_told(sea, still):
    """Put into quiet data either way round, the least size that is said to show brings what it was
    said to: noise, which helps one and hinders the other, falls out of their mean."""
    trial, decision = still
    cause = next(c for c in sea.usual.model.causes if c.label == "heading_offset")
    told = decision.told["heading_offset"]
    least = told.least(diagnose.LEAST) * cause.sizes(sea.usual.setting)
    gained = []
    for p in (0.0 * least, least, -least):
        seen = cause.read(trial.record, p)
        again = Trial(sea.usual, seen)
        _, (found,) = again.scan(again.begin({}), [cause])
        gained.append(found.evidence)
    brought = 0.5 * (gained[1] + gained[2]) - gained[0]
    assert brought == pytest.approx(diagnose.LEAST + told.cost, rel=0.15)


def test_nothing_is_said_with_what_may_be_too_small(sea, still):
    """Each cause's sizes that would not show, a decade of them as likely as another: here half of
    one, up to 0.1^0.5."""
    _, decision = still
    assert {"bank", "current", "payload"} <= set(decision.hidden)
    one = replace(decision, told={"bank": Told(np.array([2.0 * diagnose.LEAST / 0.1]), 0.0)})
    assert one.hidden == pytest.approx({"bank": 0.5})
    assert one.nothing_there == pytest.approx((1 / 3) / (1 / 3 + 2 / 3 * 0.5))
    ranked = {r["name"]: r["probability"] for r in ranking_json(one, "none", ())}
    assert ranked["none"] == pytest.approx(0.5, abs=0.02)
    assert ranked["bank"] == pytest.approx(0.5, abs=0.02)
    said = limits_json(decision, sea.usual.model.causes, sea.usual.setting)
    shares = [limit["share"] for limit in said]
    assert shares == sorted(shares)
    turned = next(limit for limit in said if limit["name"] == "heading_offset")
    assert 0.1 < turned["parameters"]["angle"]["value"] < 5.0  # deg


def test_a_heading_offset_is_named_and_sized(compass):
    _, decision = compass
    assert (decision.verdict, labels(decision)) == ("named", ["heading_offset"])
    angle = decision.named[0].shown["angle"]
    assert angle.value == pytest.approx(truth(hidden("heading_offset"))["angle"], rel=0.08, abs=0.1)
    assert angle.low < angle.value < angle.high


def test_a_cause_of_the_users_own_is_named(sea, trials):
    """A line to a point ten kilometres off: a constant pull along the earth's axes, 1.5 N."""
    towards = {"tether_north": 8000.0, "tether_east": -6000.0}
    _, decision = judged(sea.usual, trials("none", tether=1.5, **towards))
    assert labels(decision) == ["far_tether"]
    shown = decision.named[0].shown
    assert shown["north"].value == pytest.approx(1.2, abs=0.12)
    assert shown["east"].value == pytest.approx(-0.9, abs=0.12)
    assert decision.named[0].cause.user


# --- without any key: what must change with the data, and what must not


def turned(seen):
    """The pond turned by 90 deg: what was north is east."""
    state = seen.state.copy()
    state[:, 0], state[:, 2] = -seen.state[:, 2], seen.state[:, 0]
    state[:, 4] += 0.5 * math.pi
    return replace(seen, state=state)


def mirrored(seen):
    """Port is starboard: the ship, its rudders, the pond and the wind."""
    state = seen.state * [1.0, 1.0, -1.0, -1.0, -1.0, -1.0]
    actuator = seen.actuator[:, [1, 0, 2]] * [-1.0, -1.0, 1.0]
    return replace(seen, state=state, actuator=actuator, wind=seen.wind * [1.0, -1.0])


def test_turning_the_pond_turns_the_current(sea):
    _, decision = judged(sea.usual, turned(sea.done.trial.record))
    assert labels(decision) == ["current"]
    before, after = (d.named[0].shown for d in (sea.done.decision, decision))
    assert apart(after["direction"].value, before["direction"].value + 90.0) < 2.0
    assert after["speed"].value == pytest.approx(before["speed"].value, rel=0.02)


def test_turning_the_pond_leaves_the_compass(sea, compass):
    trial, plain = compass
    _, decision = judged(sea.usual, turned(trial.record))
    assert labels(decision) == ["heading_offset"]
    assert decision.named[0].numbers == pytest.approx(plain.named[0].numbers, rel=0.03)


def test_mirroring_all_flips_the_current_across(sea):
    """What was usual is learnt from the mirrored campaign too."""
    start = sea.run.base()[1]
    nominal = record_of(sea.store, list(NOMINAL), PROFILE)
    usual = reference.learn(sea.usual.model, sea.usual.setting, start, mirrored(nominal))
    _, decision = judged(usual, mirrored(sea.done.trial.record))
    assert labels(decision) == ["current"]
    north, east = sea.done.decision.named[0].numbers
    assert decision.named[0].numbers == pytest.approx([north, -east], abs=0.01)


def test_taken_out_of_the_data_it_is_gone(sea, compass):
    trial, decision = compass
    named = decision.named[0]
    _, after = judged(sea.usual, named.cause.read(trial.record, named.numbers))
    assert (after.verdict, labels(after)) == ("none", [])


def test_more_noise_makes_no_surer(sea):
    """White noise as large as the instruments' own, on top of it: the same name, less evidence."""
    seen = sea.done.trial.record
    sigma = np.array([0.02, 0.01, 0.02, 0.01, math.radians(0.1), math.radians(0.1)])
    rng = np.random.default_rng(0)
    noisy = replace(seen, state=seen.state + sigma * rng.standard_normal(seen.state.shape))
    _, decision = judged(sea.usual, noisy)
    assert labels(decision) == ["current"]
    assert decision.named[0].evidence < 1.02 * sea.done.decision.named[0].evidence
    assert decision.named[0].probability <= sea.done.decision.named[0].probability + 1e-6


def test_half_the_data_has_the_same_name(sea):
    """One of the two voyages alone: less evidence, a wider interval."""
    whole = sea.done.decision.named[0]
    _, decision = judged(sea.usual, sea.done.trial.record.pick(["trial_2"]))
    assert labels(decision) == ["current"]
    half = decision.named[0]
    assert half.evidence < 0.8 * whole.evidence
    assert np.linalg.det(half.covariance) > 1.2 * np.linalg.det(whole.covariance)


def test_reversing_the_campaign_turns_a_drift_round(sea, trials):
    """Thrust 1 + p s becomes (1 + p) (1 - p s / (1 + p)): a loss with a recovery."""
    seen = trials("thrust_drift", size=1.5)
    _, plain = judged(sea.usual, seen)
    assert labels(plain) == ["thrust_drift"]
    back = Trial(sea.usual, replace(seen, share=1.0 - seen.share))
    point = back.begin({})
    both = ("thrust_loss", "thrust_drift")
    _, found = settle(back, both, {n: np.zeros(1) for n in both}, point.path)
    loss, drift = (found.numbers[n][0] for n in both)
    sure = np.sqrt(np.diag(found.covariance))
    (slope,) = plain.named[0].numbers
    assert loss == pytest.approx(slope, abs=2.0 * sure[0])
    assert drift == pytest.approx(-slope / (1.0 + slope), abs=2.0 * sure[1])
    assert drift > 2.0 * sure[1]


def test_of_shuffled_time_nothing_drifts(sea, trials):
    """Each half minute of the campaign at another's place in it: a loss, and no drift beside it."""
    seen = trials("thrust_drift", size=1.5)
    drift = next(c for c in sea.usual.model.causes if c.label == "thrust_drift")
    pieces = np.array_split(seen.share, round(len(seen) * seen.step / 30.0))
    order = np.random.default_rng(0).permutation(len(pieces))
    shuffled = np.concatenate(
        [np.resize(pieces[i], len(p)) for i, p in zip(order, pieces, strict=True)]
    )
    gained = []
    for share in (seen.share, shuffled):
        trial = Trial(sea.usual, replace(seen, share=share))
        _, (found,) = trial.scan(trial.begin({}), [drift], ("thrust_loss",))
        gained.append(found.evidence)
    assert gained[0] > 4.0 and gained[1] < 1.0


def test_in_each_others_places_nothing_depends_on_position(sea, trials, monkeypatch):
    """A line to a bollard amid the pond; each voyage with the other's places."""
    seen = trials("none")
    north, east = seen.state[:, 0].mean(), seen.state[:, 2].mean()
    pulled = trials("none", tether=3.0, tether_north=float(north), tether_east=float(east))
    trial = Trial(sea.usual, pulled)
    point = trial.begin({})
    base, _ = trial.scan(point, ())

    def explained() -> float:
        found = unnamed.Structures(trial, point).found(point, base, ())
        return next(f.evidence for f in found if f.name == "position")

    before = explained()
    plain = structure.at_knots

    def exchanged(cut, grid):
        knots = plain(cut, grid)
        if len(cut) != len(trial.rows):
            return knots
        state = knots.state.copy()
        state[..., [0, 2]] = np.roll(state[..., [0, 2]], len(cut) // 2, axis=0)
        return structure.Knots(state, knots.driven)

    monkeypatch.setattr(structure, "at_knots", exchanged)
    assert before > diagnose.UNKNOWN
    assert explained() < 0.5 * before


def test_beside_a_late_clock_the_other_instruments_are_read_at_its_time(sea):
    """An antenna's columns come from what is measured: 1.4 s apart they are other ones, and the
    position and the velocity would seem to disagree."""
    trial = Trial(sea.usual, sea.done.trial.record)
    trial.at({})
    numbers = {"clock_offset:gnss": np.array([1.4])}
    late = trial.at(numbers)
    ref = sea.usual
    cut, moved, shown = reading.read(ref.model, ref.setting, trial.record, trial.rows, numbers)
    whole = np.concatenate((ref.theta, ref.columns.numbers(numbers)))
    fresh = linearise.linear(ref.model, whole, cut, trial.grid, late.path, moved, shown)
    columns = ref.columns.of["antenna_offset"]
    assert late.linear.j[..., columns] == pytest.approx(fresh.j[..., columns], abs=1e-5)


def test_what_a_clock_would_change_is_of_the_motion_and_not_of_its_noise(sea):
    """The column is the velocity's derivative. Were it that of what was measured, noise would pass
    for what the data tell: of noise as the sensor has it, 0.01 m/s, two fifths of it at most."""
    seen, ref = sea.done.trial.record, sea.usual
    rows, column = sea.done.trial.rows, ref.columns.of["clock_offset:velocity"][0]
    column -= ref.columns.base
    noise = np.zeros_like(seen.state)
    noise[:, 1] = 0.01 * np.random.default_rng(5).standard_normal(len(seen))
    quiet = reading.read(ref.model, ref.setting, seen, rows)[2][..., 1, column]
    noisy = replace(seen, state=seen.state + noise)
    loud = reading.read(ref.model, ref.setting, noisy, rows)[2][..., 1, column]
    assert (loud - quiet).std() < 0.4 * quiet.std()
    change = np.diff(segments.cut(seen, rows).y[..., 1], axis=1) / timescale.BIN
    between = 0.5 * (quiet[:, 1:] + quiet[:, :-1])
    assert np.corrcoef(between.ravel(), change.ravel())[0, 1] > 0.75


def test_what_a_lag_would_change_is_after_a_step_and_not_before(sea):
    """(y_T - y_0) / T of a step by h: -h exp(-t/T) / T from the step on. With a lead's difference
    in it, a step would be a spike, and a rudder recorded in steps would tell of no lag."""
    seen, ref = sea.done.trial.record, sea.usual
    (lag,) = (c for c in ref.model.causes if c.label == "rudder_lag")
    time = reading.STEP * lag.sizes(ref.setting)[0]
    column = ref.columns.of["rudder_lag"][0] - ref.columns.base
    step = np.zeros_like(seen.actuator)
    step[1000:, 0] = 0.2
    stepped = replace(seen, actuator=step)
    moved = reading.read(ref.model, ref.setting, stepped, np.array([900]))[1][0, :, 0, column]
    # straight from row to row: the step is half a row before
    t = (900 - 1000 + 0.5 + timescale.NODE_ROWS * np.arange(len(moved))) * seen.step
    assert np.abs(moved[t < -0.15]).max() == 0.0
    after = (t > 0.15) & (t < 5.0 * time)
    assert moved[after] == pytest.approx(-0.2 * np.exp(-t[after] / time) / time, rel=0.02)


# --- traps that make simpler methods invent causes


def test_one_wild_segment_does_not_decide(sea):
    """A shove of 0.3 m/s for some seconds in one segment: it counts less, the others decide."""
    seen = sea.done.trial.record
    trial = sea.done.trial
    row = trial.rows[5]
    t = 0.1 * np.arange(300)
    state = seen.state.copy()
    state[row : row + 300, 3] += 0.3 * np.exp(-0.5 * ((t - 15.0) / 2.0) ** 2)
    shoved, decision = judged(sea.usual, replace(seen, state=state))
    assert shoved.weight[5] < 0.3
    assert np.median(shoved.weight) == 1.0
    assert "current" in labels(decision)
    (current,) = (n for n in decision.named if n.cause.label == "current")
    assert current.shown["speed"].value == pytest.approx(truth(sea.case)["speed"], rel=0.06)


def test_masses_are_held_so_that_no_payload_eats_a_scale(sea, still):
    """Forces and masses share one scale. Each mass with its added mass is known to 8 %, and the
    load found on an ordinary day is small against the ship's 245 kg."""
    _, start, model, _ = sea.run.base()
    spread = dict(zip(model.names, start.spread, strict=True))
    value = dict(zip(model.names, start.values, strict=True))
    g = model.geometry
    own = g.mass / (0.5 * g.density * g.length**2 * g.draught)
    for name in ("body.m_x", "body.m_y"):
        assert spread[name] <= 0.08 * (own + value[name])
    trial, decision = still
    payload = next(c for c in sea.usual.model.causes if c.label == "payload")
    _, found = trial.scan(decision.first, [payload])
    assert abs(found[0].numbers["payload"][0]) < 15.0
    assert found[0].evidence < diagnose.LEAST


def test_linearising_again_brings_no_evidence_of_its_own(sea, still):
    """`Nothing` rests where it is, and a cause of no effect, settled as the named ones are, gains
    nothing on it."""
    trial, decision = still
    point = trial.at({}, decision.first.path)
    again, _ = trial.scan(point, ())
    assert again.evidence == pytest.approx(decision.nothing.evidence, abs=3.0)
    for label in ("heading_offset", "current", "yaw_rate_scale"):
        cause = next(c for c in sea.usual.model.causes if c.label == label)
        begin = {label: np.zeros(cause.count)}
        _, found = settle(trial, (label,), begin, decision.first.path)
        assert -15.0 < found.evidence - decision.nothing.evidence < diagnose.LEAST


def test_a_fit_that_runs_away_is_worth_nothing(still, monkeypatch):
    """Where a matrix of it is none any more, it has no evidence, and there is no traceback."""
    trial, decision = still

    def broken(*_):
        raise np.linalg.LinAlgError

    monkeypatch.setattr(trial, "levels", broken)
    _, found = settle(trial, ("current",), {"current": np.zeros(2)}, decision.first.path)
    assert found.evidence == -np.inf


@pytest.mark.parametrize(("lowest", "evidence"), [(-np.inf, 850.0), (0.0, -np.inf)])
def test_the_others_may_explain_far_less_without_a_cause(still, monkeypatch, lowest, evidence):
    """Linearised where they stood beside it they seem to explain 1000 nats, and 850 where they
    rest. Of one that joins, a step that costs so much went too far."""
    trial, decision = still
    at = []

    def told(*_):
        high = at[-1] > 0.15
        found = {"heading_offset": np.array([0.1])}
        return Found("nothing", 1000.0 if high else 850.0, 1.0, found, np.eye(1) * 1e-4), []

    monkeypatch.setattr(
        trial, "at", lambda n, *_: at.append(n["heading_offset"][0]) or decision.first
    )
    monkeypatch.setattr(trial, "scan", told)
    monkeypatch.setattr(trial, "rested", {})
    begin = {"heading_offset": np.array([0.16])}
    _, found = settle(trial, ("heading_offset",), begin, None, -np.inf, lowest)
    assert found.evidence == evidence


def test_where_the_others_run_away_without_a_cause_nothing_is_left(compass, monkeypatch):
    trial, decision = compass
    (one,) = decision.named
    other = replace(
        one, cause=next(c for c in trial.reference.model.causes if c.label == "current")
    )
    both = {one.cause.label: one.numbers, other.cause.label: one.numbers}
    two = replace(decision, named=(one, other), base=replace(decision.base, numbers=both))
    gone = Found("heading_offset", -np.inf, 1.0, {one.cause.label: one.numbers})
    monkeypatch.setattr(decisions, "settle", lambda *_: (decision.point, gone))
    left = decisions.without(trial, two, other)
    assert left.named == () and left.verdict == "none"
    assert (left.point, left.base) == (decision.first, decision.nothing)


def test_a_fit_that_runs_away_takes_a_shorter_step(still, monkeypatch):
    """Three halvings at most; then it has no evidence. A path of kilometres ran away, too."""
    trial, decision = still
    at, path = trial.at, decision.first.path
    away = []

    def bounded(numbers, *given):
        point = at({n: np.minimum(v, 0.2) for n, v in numbers.items()}, *given)
        if abs(numbers["heading_offset"][0]) > 0.2:
            away.append(float(numbers["heading_offset"][0]))
            return replace(point, linear=replace(point.linear, e=point.linear.e + 1e5))
        return point

    monkeypatch.setattr(trial, "at", bounded)
    monkeypatch.setattr(trial, "rested", {})
    _, found = settle(trial, ("heading_offset",), {"heading_offset": np.array([0.8])}, path)
    assert away == [0.8, 0.4] and abs(found.numbers["heading_offset"][0]) < 0.02
    assert -30.0 < found.evidence - decision.nothing.evidence < diagnose.LEAST
    away.clear()
    trial.rested.clear()
    _, found = settle(trial, ("heading_offset",), {"heading_offset": np.array([8.0])}, path)
    assert away == [8.0, 4.0, 2.0, 1.0] and found.evidence == -np.inf
    low = decision.nothing.evidence + 900.0  # nothing at rest is so high: each step went too far
    begin = {"heading_offset": np.array([0.01])}
    _, found = settle(trial, ("heading_offset",), begin, path, -np.inf, low)
    assert found.evidence == -np.inf


def test_recorded_actuators_are_no_delay(still):
    """No late rudder, no late clock on an ordinary day: evidence about zero or below."""
    trial, decision = still
    causes = [c for c in trial.reference.model.causes
              if c.label in ("rudder_delay", "rudder_lag", "clock_offset:gnss")]  # fmt: skip
    assert len(causes) == 3
    for found in trial.scan(decision.first, causes)[1]:
        assert found.evidence < 5.0
        assert abs(found.numbers[found.name][0]) < 0.15
