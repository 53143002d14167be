"""From logs to a verdict on the known ship, with seeds that nobody looked at before.

One campaign of the ship as it is and one with a current go the whole way through MCAP, the store
and the pipelines; what is nominal for it is learnt there once. Other trials are judged against it.
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
from pipelines.experiments.simulated_ship import Laws, cases, sensors
from pipelines.identify import identify_run
from pipelines.prepare import ingest_logs
from shiplog import profile_file as profiles
from shiplog.diagnosis import (
    evidence,
    likelihood,
    linear_segments,
    linearisation,
    measurement_correction,
    next_manoeuvre,
    placebo,
    raised_noise,
    relinearisation,
    search,
    segments,
    setup,
    sign_conventions,
    thresholds,
    unrecorded_thruster,
)
from shiplog.diagnosis import result as decisions
from shiplog.diagnosis.decide import decide
from shiplog.diagnosis.fitted import Found
from shiplog.diagnosis.held_out import HeldOut
from shiplog.diagnosis.relinearisation import converge, within
from shiplog.diagnosis.remainder import Remainder
from shiplog.diagnosis.trial import Trial
from shiplog.exceptions import RunError
from shiplog.training.run_config import Config, Physics
from shiplog.voyages import recording, timescale  # fmt: skip
from shiplog.voyages.ingest import ingest
from shiplog.voyages.split import choose_physical_split
from shiplog.voyages.store import Store

SEED = 7101
PROFILE = profiles.load("esso-vectwin")
NOMINAL = ("nominal_1", "nominal_3", "nominal_5", "nominal_6")  # 3400 s
TIDE = """
import jax.numpy as jnp
from shiplog.models.causes import Cause, Parameter


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


@pytest.fixture(scope="module")
def sea(tmp_path_factory):
    """The whole way, once: run, store, posterior, the diagnosis of a trial with a current."""
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
        work=work, store=store, run=run, done=done, case=case, campaign=done.trial.campaign
    )


def judged(campaign, observed):
    """A trial of a record, and the decision before anything was held out."""
    trial, point = evidence.begin(Trial.of(campaign, observed), {})
    found = search.Search(trial, point, placebo.placebos(campaign))
    found.run()
    return trial, decide(found)[0]


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
            read = recording.read([v.table for v in made], [v.name for v in made], PROFILE)
            kept[key] = replace(read, timescale=sea.done.trial.record.timescale)
        return kept[key]

    return of


@pytest.fixture(scope="module")
def still(sea, trials):
    return judged(sea.campaign, trials("none"))


@pytest.fixture(scope="module")
def compass(sea, trials):
    return judged(sea.campaign, trials("heading_offset"))


# --- the whole way


def test_a_current_is_named_and_sized(sea):
    (named,) = sea.done.decision.named
    shown, true = named.estimates, truth(sea.case)
    assert sea.done.verdict.verdict == "named"
    assert named.cause.label == "current"
    assert named.probability > 0.9
    assert shown["speed"].value == pytest.approx(true["speed"], rel=0.05)
    assert apart(shown["direction"].value, true["direction"]) < 3.0
    gain = sea.done.verdict.gain
    assert gain.real and gain.reduction > 0.5
    assert gain.windows == len(sea.done.held.cut)


CAUSES = (
    "current", "wind_force", "shallow_water", "bank", "fouling", "payload", "cross_flow_drag",
    "thrust_loss", "thrust_drift", "rudder_force", "rudder_offset", "rudder_lag",
    "rudder_delay", "side_thrust", "heading_offset", "yaw_rate_bias", "yaw_rate_scale",
    "clock_offset", "antenna_offset", "wind_direction_offset", "wind_speed_scale", "coverage",
    "external", "unknown",
)  # fmt: skip
FAMILIES = (
    "position",
    "heading",
    "time",
    "motion",
    "controls",
    "wind",
    "stochastic",
    "intermittent",
)


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
    content = json.loads((sea.work / "out" / "verdict.json").read_text("utf-8"))
    shaped(content)
    assert content["causes"][0]["name"] == "current"
    assert set(content["causes"][0]["parameters"]) == {"speed", "direction"}
    assert content["base"] == {"run": "mmg", "before_effect": True}
    said = [
        one["probability"] for one in content["ranking"]
    ]  # of each answer, whatever else is true
    assert content["ranking"][0]["name"] == "current" and said[0] > 0.9
    assert said == sorted(said, reverse=True) and min(said) >= 0.0 and max(said) <= 1.0
    report = (sea.work / "out" / "report.md").read_text("utf-8")
    assert "steady current" in report and "Gain" in report


def test_too_little_is_reported_and_nothing_named(sea):
    done = pipeline.diagnose_run(sea.run.path, sea.store, ["short"], sea.work / "short")
    content = json.loads((sea.work / "short" / "verdict.json").read_text("utf-8"))
    shaped(content)
    assert done.verdict.verdict == "coverage" and content["causes"] == []
    assert "Too little" in content["sentence"] and "100 s" in content["sentence"]


def test_a_model_without_a_path_is_a_verdict(sea, monkeypatch):
    """Whatever the numerics do ends as an answer: nothing is named and nothing raised."""

    def singular(*_):
        raise np.linalg.LinAlgError("Matrix is not positive definite")

    monkeypatch.setattr(setup, "trial_of", singular)
    done = pipeline.diagnose_run(sea.run.path, sea.store, ["trial_1"], sea.work / "away")
    content = json.loads((sea.work / "away" / "verdict.json").read_text("utf-8"))
    shaped(content)
    assert (done.verdict.verdict, content["causes"]) == ("undecided", [])
    assert "diverges" in content["sentence"] and "evaluate" in content["sentence"]


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
    content = done.verdict.as_json()
    shaped(content)
    assert content["base"] == {"run": "r", "before_effect": False}
    why = {one["name"]: one["reason"] for one in content["unavailable"]}
    for name in ("wind_force", "wind_direction_offset", "wind_speed_scale"):
        assert "no wind is recorded" in why[name]
    tested = {c.label for c in done.trial.reference.model.causes}
    assert tested >= {"current", "clock_offset:gnss", "fouling", "payload"}
    assert not tested & {"wind_force", "clock_offset:wind", "wind_speed_scale"}
    assert not any(one["name"] == "unknown:wind" for one in content["ranking"])


def test_a_model_that_simulates_nothing_names_nothing(sea):
    """Worse than keeping all velocities, with what was named in it too."""
    held = sea.done.held
    assert held.lost(sea.done.verdict.gain) == ""
    away = replace(sea.done.verdict.gain, after=1e8)  # with what is named in it, it diverges
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
             "the propeller's sign turned round", "the one that it blows towards"),
)  # fmt: skip
def test_a_sign_that_is_the_other_way_round_is_found(sea, said):
    """Each is its own inverse: turned back, the model is as good as it was. Its current is in it:
    what a wrong sign does must not drown in what else is wrong."""
    cut, model = sea.done.held.cut, sea.done.after
    (turned,) = [w for s, w in sign_conventions.other(PROFILE, cut) if said in s]
    found, loss = sign_conventions.best(model, turned)
    assert said in found
    assert loss == pytest.approx(model.losses(cut).mean(), rel=1e-4)
    why = HeldOut(turned, model, sea.done.trial).lost(None)
    if "sign" in said:  # the others do not double the error of so short a trial
        assert said in why and f"L is {loss:.0f}" in why
    assert HeldOut(cut, model, sea.done.trial).lost(None) == ""


def test_whole_voyages_are_left_out_and_of_one_alone_its_halves(sea):
    """Each window once, and of its voyage no row of the same half in the numbers."""
    held = sea.done.held
    folds = list(held.folds())
    assert [(name, half) for name, half, _ in folds] == [
        (name, None) for name in dict.fromkeys(held.voyages)
    ]
    assert held.left_out == "its voyage"
    alone = HeldOut(held.cut.pick(folds[0][2]), held.before, held.trial)
    assert alone.left_out == "its half of the voyage"
    halves = list(alone.folds())
    assert [late for _, (_, late), _ in halves] == [False, True]
    rows = np.concatenate([rows for _, _, rows in halves])
    assert sorted(rows) == list(range(len(alone.voyages)))
    size = float(alone.cut.dt[0].sum())
    for _, (middle, late), rows in halves:
        for row in alone.cut.plan[rows].to_dicts():
            inside = (row["elapsed"], row["elapsed"] + size)
            assert min(inside) >= middle - 1.0 if late else max(inside) <= middle + 1.0


def test_the_manoeuvre_that_separates_is_the_seamans(sea):
    """Rudders must move to tell a lag from a delay, screws turn to tell lost thrust from a rough
    hull, and the ship swing both ways to tell a gyro's scale from its bias."""
    trial = sea.done.trial
    grams = dict(
        zip(
            (m.text(1.0) for m in next_manoeuvre.MANOEUVRES),
            next_manoeuvre.sailed(trial, {}),
            strict=True,
        )
    )
    by = {c.label: c for c in sea.campaign.reference.model.causes}

    def worth(label, numbers, other):
        one = replace(sea.done.decision.named[0], cause=by[label], numbers=np.array(numbers))
        return {
            w.split(",")[0]: next_manoeuvre.apart(trial, g, one, other) for w, g in grams.items()
        }

    lag = worth("rudder_lag", [2.0], "rudder_delay")
    assert lag["a drifting stop"] == pytest.approx(0.0, abs=1e-3)
    assert lag["doublets of 3 s at constant revolutions"] > 5.0
    power = worth("thrust_loss", [-0.2], "fouling")
    assert power["full power and no power in turn"] > 1.5 * power["a drifting stop"]
    gyro = worth("yaw_rate_scale", [0.03], "yaw_rate_bias")
    assert gyro["a zigzag"] > 10.0 * gyro["a drifting stop"]
    assert all(v >= -1e-6 for found in (lag, power, gyro) for v in found.values())


def test_an_unrecorded_thruster_is_placed_where_it_stands(monkeypatch):
    """Its place [m ahead of midship] and force between those that are tried first, from products
    drawn with it: sway and yaw rate pushed together."""
    rng = np.random.default_rng(5)
    ship, coefficients = afloat.MODEL, dict(zip(afloat.MODEL.names, afloat.THETA, strict=True))
    unit = unrecorded_thruster.accelerations(ship, coefficients, np.array([[0.0, 1.0, 1.1]]))[0]
    knots, count = 16, 300
    process_noise = replace(afloat.PROCESS_NOISE, intermittent=1.7 * unit)
    z = np.eye(6 + 3 * knots)[None].repeat(count, 0)  # all of it seen, as well as a knot can be
    drawn = np.zeros((count, 6 + 3 * knots, 1))
    drawn[:, 6:, 0] = rng.multivariate_normal(
        np.zeros(3 * knots), process_noise.kernel(knots), count
    )
    sure = 1e12
    weighed = likelihood.Weighed(
        sure * np.swapaxes(drawn, 1, 2) @ drawn, sure * drawn, sure * z, 0.0, knots
    )
    reference = SimpleNamespace(
        model=SimpleNamespace(stand_in=ship), coefficients=coefficients,
        setting=SimpleNamespace(scale={"length": 3.0}), counts=1.0,
    )  # fmt: skip
    cut = segments.Cut(
        np.arange(count), np.zeros((count, 1, 6)), np.ones((count, 1, 6), dtype=bool),
        np.zeros((count, 1, 1)), np.zeros(count), 0.2,
    )  # fmt: skip
    path = linear_segments.Path(np.zeros((count, 6)), np.zeros((count, 3, knots)))
    linear = linear_segments.Linear(
        cut, path, np.zeros((count, 1, 6)), np.zeros((count, 1, 6, 6 + 3 * knots)),
        np.zeros((count, 1, 6, 0)),
    )  # fmt: skip
    monkeypatch.setattr(likelihood, "weighed", lambda *_: weighed)
    # an earlier force is no matter
    noise = replace(process_noise, intermittent=np.array([9.0, 9.0, 9.0]))
    plain = replace(noise, intermittent=None)
    left = raised_noise.left_by(linear, np.zeros(0), plain, np.ones(count), 1.0)
    found = unrecorded_thruster.estimate_side_force(left, reference)
    assert found.lever == pytest.approx(1.1, abs=0.05)
    assert found.force == pytest.approx(1.7, rel=0.1)
    assert found.gain > 1000.0


def test_a_path_may_follow_a_force_that_comes_and_goes(sea):
    """By as much as the process noise and it together may push, twice."""
    ref, force = sea.campaign.reference, (0.0, 0.02, 0.01)
    plain = ref.held(1.5, Remainder())
    pulsed = ref.held(1.5, Remainder("intermittent", channels=(1.0, 2.0, 1.0), intermittent=force))
    assert pulsed.acceleration**2 == pytest.approx(
        (plain.acceleration * (1.0, 2.0, 1.0)) ** 2 + (2.0 * np.array(force)) ** 2
    )


def test_causes_settle_from_where_they_rested_before(compass):
    """From far away a second time: one linearisation, and the same rest."""
    trial, decision = compass
    (label,) = labels(decision)
    asked = []

    class Counted(Trial):
        def at(self, numbers, *given):
            asked.append(numbers)
            return super().at(numbers, *given)

    again, point = evidence.begin(Counted.of(trial.campaign, trial.record), {})
    asked.clear()
    rests = []
    for begin in (0.5, -0.5):
        _, found = converge(again, (label,), {label: np.array([begin])}, point.path)
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


# --- what is hidden, and what is not


def test_nothing_hidden_is_nothing_named(still):
    _, decision = still
    assert (decision.verdict, labels(decision)) == ("none", [])
    assert decision.side_force is None and decision.structure is None
    assert max(decision.ranking, key=decision.ranking.get) == "none"


def test_a_heading_offset_is_named_and_sized(compass):
    _, decision = compass
    assert (decision.verdict, labels(decision)) == ("named", ["heading_offset"])
    angle = decision.named[0].estimates["angle"]
    assert angle.value == pytest.approx(truth(hidden("heading_offset"))["angle"], rel=0.08, abs=0.1)
    assert angle.low < angle.value < angle.high


def test_a_cause_of_the_users_own_is_named(sea, trials):
    """A line to a point ten kilometres off: a constant pull along the earth's axes, 1.5 N."""
    towards = {"tether_north": 8000.0, "tether_east": -6000.0}
    _, decision = judged(sea.campaign, trials("none", tether=1.5, **towards))
    assert labels(decision) == ["far_tether"]
    shown = decision.named[0].estimates
    assert shown["north"].value == pytest.approx(1.2, abs=0.12)
    assert shown["east"].value == pytest.approx(-0.9, abs=0.12)
    assert decision.named[0].cause.user


# --- without any key: what must change with the data, and what must not


def turned(observed):
    """The pond turned by 90 deg: what was north is east."""
    state = observed.state.copy()
    state[:, 0], state[:, 2] = -observed.state[:, 2], observed.state[:, 0]
    state[:, 4] += 0.5 * math.pi
    return replace(observed, state=state)


def test_turning_the_pond_turns_the_current(sea):
    _, decision = judged(sea.campaign, turned(sea.done.trial.record))
    assert labels(decision) == ["current"]
    before, after = (d.named[0].estimates for d in (sea.done.decision, decision))
    assert apart(after["direction"].value, before["direction"].value + 90.0) < 2.0
    assert after["speed"].value == pytest.approx(before["speed"].value, rel=0.02)


def test_turning_the_pond_leaves_the_compass(sea, compass):
    trial, plain = compass
    _, decision = judged(sea.campaign, turned(trial.record))
    assert labels(decision) == ["heading_offset"]
    (after,), (before,) = decision.named, plain.named
    sure = np.sqrt(before.covariance[0, 0])
    assert after.numbers == pytest.approx(before.numbers, abs=0.5 * sure)


def test_taken_out_of_the_data_it_is_gone(sea, compass):
    trial, decision = compass
    named = decision.named[0]
    _, after = judged(sea.campaign, named.cause.read(trial.record, named.numbers))
    assert (after.verdict, labels(after)) == ("none", [])


def test_more_noise_makes_no_surer(sea):
    """White noise as large as the instruments' own, on top of it: the same name, less evidence."""
    observed = sea.done.trial.record
    sigma = np.array([0.02, 0.01, 0.02, 0.01, math.radians(0.1), math.radians(0.1)])
    rng = np.random.default_rng(0)
    noisy = replace(
        observed, state=observed.state + sigma * rng.standard_normal(observed.state.shape)
    )
    _, decision = judged(sea.campaign, noisy)
    assert labels(decision) == ["current"]
    assert decision.named[0].evidence < 1.02 * sea.done.decision.named[0].evidence
    assert decision.named[0].probability <= sea.done.decision.named[0].probability + 1e-6


def test_half_the_data_has_the_same_name(sea):
    """One of the two voyages alone: less evidence, a wider interval."""
    whole = sea.done.decision.named[0]
    _, decision = judged(sea.campaign, sea.done.trial.record.pick(["trial_2"]))
    assert labels(decision) == ["current"]
    half = decision.named[0]
    assert half.evidence < whole.evidence
    assert np.linalg.det(half.covariance) > 1.2 * np.linalg.det(whole.covariance)


def test_with_a_late_clock_the_other_instruments_are_read_at_its_time(sea):
    """An antenna's columns come from what is measured: 1.4 s apart they are other ones, and the
    position and the velocity would seem to disagree."""
    trial = Trial.of(sea.campaign, sea.done.trial.record)
    trial.at({})
    numbers = {"clock_offset:gnss": np.array([1.4])}
    late = trial.at(numbers)
    ref = sea.campaign.reference
    cut, moved, shown = measurement_correction.read(
        ref.model, ref.setting, trial.record, trial.rows, numbers
    )
    whole = np.concatenate((ref.theta, ref.columns.numbers(numbers)))
    fresh = linearisation.linear(ref.model, whole, cut, trial.grid, late.path, moved, shown)
    columns = ref.columns.of["antenna_offset"]
    assert late.linear.j[..., columns] == pytest.approx(fresh.j[..., columns], abs=1e-5)


def test_what_a_clock_would_change_is_of_the_motion_and_not_of_its_noise(sea):
    """The column is the velocity's derivative. Were it that of what was measured, noise would pass
    for what the data tell: of noise as the sensor has it, 0.01 m/s, two fifths of it at most."""
    observed, ref = sea.done.trial.record, sea.campaign.reference
    rows, column = sea.done.trial.rows, ref.columns.of["clock_offset:velocity"][0]
    column -= ref.columns.base
    noise = np.zeros_like(observed.state)
    noise[:, 1] = 0.01 * np.random.default_rng(5).standard_normal(len(observed))
    quiet = measurement_correction.read(ref.model, ref.setting, observed, rows)[2][..., 1, column]
    noisy = replace(observed, state=observed.state + noise)
    loud = measurement_correction.read(ref.model, ref.setting, noisy, rows)[2][..., 1, column]
    assert (loud - quiet).std() < 0.4 * quiet.std()
    change = np.diff(segments.cut(observed, rows).y[..., 1], axis=1) / timescale.BIN
    between = 0.5 * (quiet[:, 1:] + quiet[:, :-1])
    assert np.corrcoef(between.ravel(), change.ravel())[0, 1] > 0.75


def test_what_a_lag_would_change_is_after_a_step_and_not_before(sea):
    """(y_T - y_0) / T of a step by h: -h exp(-t/T) / T from the step on. With a lead's difference
    in it, a step would be a spike, and a rudder recorded in steps would tell of no lag."""
    observed, ref = sea.done.trial.record, sea.campaign.reference
    (lag,) = (c for c in ref.model.causes if c.label == "rudder_lag")
    time = measurement_correction.READ_STEP * lag.sizes(ref.setting)[0]
    column = ref.columns.of["rudder_lag"][0] - ref.columns.base
    step = np.zeros_like(observed.actuator)
    step[1000:, 0] = 0.2
    stepped = replace(observed, actuator=step)
    moved = measurement_correction.read(ref.model, ref.setting, stepped, np.array([900]))[1][
        0, :, 0, column
    ]
    # straight from row to row: the step is half a row before
    t = (900 - 1000 + 0.5 + timescale.NODE_ROWS * np.arange(len(moved))) * observed.step
    assert np.abs(moved[t < -0.15]).max() == 0.0
    after = (t > 0.15) & (t < 5.0 * time)
    assert moved[after] == pytest.approx(-0.2 * np.exp(-t[after] / time) / time, rel=0.02)


# --- traps that make simpler methods invent causes


def test_one_wild_segment_does_not_decide(sea):
    """A shove of 0.3 m/s for some seconds in one segment: it counts less, the others decide."""
    observed = sea.done.trial.record
    trial = sea.done.trial
    row = trial.rows[5]
    t = 0.1 * np.arange(300)
    state = observed.state.copy()
    state[row : row + 300, 3] += 0.3 * np.exp(-0.5 * ((t - 15.0) / 2.0) ** 2)
    shoved, decision = judged(sea.campaign, replace(observed, state=state))
    assert shoved.weight[5] < 0.5 * trial.weight[5]
    assert np.median(shoved.weight) == 1.0
    assert "current" in labels(decision)
    (current,) = (n for n in decision.named if n.cause.label == "current")
    assert current.estimates["speed"].value == pytest.approx(truth(sea.case)["speed"], rel=0.06)


def test_a_fit_that_runs_away_is_worth_nothing(still, monkeypatch):
    """Where a matrix of it is none any more, it has no evidence, and there is no traceback."""
    trial, decision = still

    def broken(*_):
        raise np.linalg.LinAlgError

    monkeypatch.setattr(evidence, "levels", broken)
    path = decision.nothing.point.path
    _, found = converge(replace(trial, converged={}), ("current",), {"current": np.zeros(2)}, path)
    assert found.evidence == -np.inf


@pytest.mark.parametrize(("lowest", "holds"), [(-np.inf, True), (0.0, False)])
def test_the_others_may_explain_far_less_without_a_cause(still, monkeypatch, lowest, holds):
    """Linearised where they stood beside it they seem to explain more than where they rest, by
    more than a step may cost. Of one that joins, a step that costs so much went too far."""
    trial, decision = still
    at, seemed = [], 1000.0
    rests = seemed - 1.5 * relinearisation.STEP_NATS

    def scanned(*_):
        high = at[-1] > 0.15
        found = {"heading_offset": np.array([0.1])}
        return Found("nothing", seemed if high else rests, 1.0, found, np.eye(1) * 1e-4), []

    point = decision.nothing.point
    monkeypatch.setattr(Trial, "at", lambda _, n, *more: at.append(n["heading_offset"][0]) or point)
    monkeypatch.setattr(evidence, "scan", scanned)
    monkeypatch.setattr(evidence, "fit", lambda *given: scanned(*given)[0])
    begin = {"heading_offset": np.array([0.16])}
    _, found = converge(replace(trial, converged={}), ("heading_offset",), begin, None, lowest)
    assert found.evidence == (rests if holds else -np.inf)


def test_where_the_others_run_away_without_a_cause_nothing_is_left(compass, monkeypatch):
    trial, decision = compass
    (one,) = decision.named
    other = replace(
        one, cause=next(c for c in trial.reference.model.causes if c.label == "current")
    )
    both = {one.cause.label: one.numbers, other.cause.label: one.numbers}
    shown = replace(decision.fit, found=replace(decision.fit.found, numbers=both))
    two = replace(decision, named=(one, other), fit=shown)
    gone = Found("heading_offset", -np.inf, 1.0, {one.cause.label: one.numbers})
    monkeypatch.setattr(decisions, "converge", lambda *_, **__: (decision.fit.point, gone))
    left = decisions.without(trial, two, other)
    assert left.named == () and left.verdict == "none"
    assert left.fit is decision.nothing


def test_a_fit_that_runs_away_takes_a_shorter_step(still, monkeypatch):
    """Three halvings at most; then it has no evidence. A path of kilometres diverged, too."""
    trial, decision = still
    at, path = Trial.at, decision.nothing.point.path
    away = []

    def bounded(self, numbers, *given):
        point = at(self, {n: np.minimum(v, 0.2) for n, v in numbers.items()}, *given)
        if abs(numbers["heading_offset"][0]) > 0.2:
            away.append(float(numbers["heading_offset"][0]))
            return replace(point, linear=replace(point.linear, e=point.linear.e + 1e5))
        return point

    monkeypatch.setattr(Trial, "at", bounded)
    trial = replace(trial, converged={})
    _, found = converge(trial, ("heading_offset",), {"heading_offset": np.array([0.8])}, path)
    assert away == [0.8, 0.4] and abs(found.numbers["heading_offset"][0]) < 0.02
    assert -30.0 < found.evidence - decision.nothing.found.evidence < thresholds.SHOWS_NATS
    away.clear()
    trial.converged.clear()
    _, found = converge(trial, ("heading_offset",), {"heading_offset": np.array([8.0])}, path)
    assert away == [8.0, 4.0, 2.0, 1.0] and found.evidence == -np.inf
    # nothing at rest is so high: each step went too far
    low = decision.nothing.found.evidence + 900.0
    begin = {"heading_offset": np.array([0.01])}
    _, found = converge(trial, ("heading_offset",), begin, path, low)
    assert found.evidence == -np.inf
