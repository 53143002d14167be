"""From logs to a verdict on the known ship, with seeds that nobody looked at before.

One campaign of the ship as it is and one with a current go the whole way through MCAP, the store
and the pipelines; what is nominal for it is estimated there once.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
import sailing
from contract_shape import shaped
from whole_way import PROFILE, apart, labels, truth

import shiplog
from shiplog.commands import diagnose as pipeline
from shiplog.commands.prepare import ingest_logs
from shiplog.diagnosis.hypotheses import as_it_stands, evidence
from shiplog.diagnosis.hypotheses.evaluate import resume
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.residual import next_manoeuvre
from shiplog.diagnosis.trial import setup
from shiplog.diagnosis.trial.fitted import Fit, Start
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict import exchanged_twins, sign_conventions
from shiplog.diagnosis.verdict.held_out import HeldOut
from shiplog.exceptions import RunError, UsageError
from shiplog.voyages.contradictions import twins
from shiplog.voyages.store.store import Store

pytestmark = pytest.mark.nightly


def test_a_current_is_named_and_sized(sea):
    (named,) = sea.done.decision.named
    found, true = named.estimates, truth(sea.case)
    assert sea.done.verdict.verdict == "named"
    assert named.cause.label == "current"
    assert named.probability > 0.9
    assert found["speed"].value == pytest.approx(true["speed"], rel=0.05)
    assert apart(found["direction"].value, true["direction"]) < 3.0
    gain = sea.done.verdict.gain
    assert gain.real and gain.reduction > 0.5
    assert gain.windows == len(sea.done.held.cut)


def test_the_answer_has_the_shape_of_the_contract(sea):
    content = json.loads((sea.work / "out" / "verdict.json").read_text("utf-8"))
    shaped(content)
    assert content["causes"][0]["name"] == "current"
    assert set(content["causes"][0]["parameters"]) == {"speed", "direction"}
    assert content["base"] == {"run": "mmg", "before_effect": True}
    # of each answer, whatever else is true
    reported = [one["probability"] for one in content["ranking"]]
    assert content["ranking"][0]["name"] == "current" and reported[0] > 0.9
    assert reported == sorted(reported, reverse=True)
    assert min(reported) >= 0.0 and max(reported) <= 1.0
    report = (sea.work / "out" / "report.md").read_text("utf-8")
    assert "steady current" in report and "Gain" in report
    assert sea.done.recording.read_bytes()[:4] == b"RRF2"


def test_too_little_is_reported_and_nothing_named(sea):
    done = pipeline.diagnose_run(sea.run.path, sea.store, ["short"], sea.work / "short")
    content = json.loads((sea.work / "short" / "verdict.json").read_text("utf-8"))
    shaped(content)
    assert done.verdict.verdict == "coverage" and content["causes"] == []
    assert "Too little" in content["sentence"] and "100 s" in content["sentence"]


def test_a_model_without_a_path_is_a_verdict(sea, monkeypatch):
    """Whatever the numerics do ends as an answer: nothing is named and nothing raised."""

    def singular(*_, **__):
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
    assert "worse than one that keeps its velocities" in wild.lost(None)


def with_diverged(held, rows):
    """The same windows, in some of which the model diverges."""
    states = held.states_before.copy()
    states[rows, -1] = np.inf
    made = HeldOut(held.cut, held.before, held.trial)
    made.__dict__["states_before"] = states
    return made


def test_a_window_in_which_the_model_diverges_is_in_no_figure(sea):
    """One would outweigh all others: the figures are those of the windows without it."""
    held, decision = sea.done.held, sea.done.decision
    one = with_diverged(held, [0])
    assert (one.not_counted, held.not_counted) == (1, 0)
    assert one.lost(None) == ""
    found, whole = one.gain(decision), held.gain(decision)
    assert found.windows == whole.windows - 1
    before = held.losses_before[1:].sum(1).mean()
    assert found.before == pytest.approx(before)
    assert 0.0 < found.reduction < 1.0


def test_a_model_that_diverges_in_most_windows_names_nothing(sea):
    held = sea.done.held
    every = with_diverged(held, range(len(held.cut)))
    assert every.not_counted == 0  # they are all counted, and each is as bad as can be
    assert every.losses_before.min() >= 1e9
    assert "and 3000000000 as log and profile have it" in every.lost(None)


@pytest.mark.parametrize(
    "words", ("the rudder's sign turned round", "the two rudders exchanged",
             "the propeller's sign turned round", "the one that it blows towards"),
)  # fmt: skip
def test_a_sign_that_is_the_other_way_round_is_found(sea, words):
    """Each is its own inverse: turned back, the model is as good as it was. Its current is in it:
    what a wrong sign does must not drown in what else is wrong."""
    cut, model = sea.done.held.cut, sea.done.after
    (turned,) = [
        one.windows for one in sign_conventions.conventions(PROFILE, cut) if words in one.words
    ]
    found = sign_conventions.try_conventions(model, turned)
    assert words in found.words
    assert found.loss == pytest.approx(model.losses(cut).mean(), rel=1e-4)
    why = HeldOut(turned, model, sea.done.trial).lost(None)
    if "sign" in words:  # the others do not double the error of so short a trial
        assert words in why and f"L is {found.loss:.0f}" in why
    if "exchanged" in words:  # a cause, too: a decision that names it is not taken back
        assert found.cause == "actuators_exchanged"
        held = HeldOut(turned, model, sea.done.trial)
        held.__dict__["_other"] = replace(found, loss=0.0)
        assert words in held.lost(None, {"current"})
        assert held.lost(None, {found.cause}) == ""
    assert HeldOut(cut, model, sea.done.trial).lost(None) == ""


def test_two_rudders_exchanged_are_told_by_the_evidence_of_both_orders(sea):
    """Read the other way round, what is lost by one exchange is won by the next."""
    (pair,) = twins.pairs(PROFILE)
    campaign, record = sea.done.trial.campaign, sea.done.trial.record
    known = {one.cause.label: one.numbers for one in sea.done.decision.named}

    def gained(observed):
        trial, at = as_it_stands.begin(Trial.build(campaign, observed, [*known]), known)
        return exchanged_twins.gain(trial, at, known, pair)

    lost = gained(record)
    assert lost < -exchanged_twins.LEAST_NATS
    swapped = replace(record, actuator=record.actuator[:, [1, 0, 2]])
    assert gained(swapped) == pytest.approx(-lost, rel=0.2)


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


def test_windows_feel_a_current_and_not_the_clock_of_the_position(sea):
    trial, decision, clock = sea.done.trial, sea.done.decision, "clock_offset:position"
    (current,) = decision.named
    both = tuple(sorted((current.cause.label, clock)))
    numbers = {current.cause.label: current.numbers, clock: np.array([0.3])}
    fit = resume(trial, both, Remainder(), Start(numbers, decision.fit.point.path))
    point, found = fit.point, fit.estimate
    by = {c.label: c for c in sea.campaign.reference.model.causes}
    late = replace(current, cause=by[clock], numbers=found.numbers[clock])
    joint = replace(decision, fit=Fit(point, found, Remainder()), named=(current, late))
    assert abs(found.numbers[clock]).max() > 0.0
    assert sea.done.held.changes_velocity(joint, current)
    assert not sea.done.held.changes_velocity(joint, late)


def test_the_manoeuvre_that_separates_is_the_seamans(sea):
    """Rudders must move to tell a lag from a delay, screws turn to tell lost thrust from a rough
    hull, and the ship swing both ways to tell a gyro's scale from its bias."""
    trial = sea.done.trial
    grams = dict(
        zip(
            (m.text(1.0) for m in next_manoeuvre.MANOEUVRES),
            next_manoeuvre.products_of_manoeuvres(trial, {}),
            strict=True,
        )
    )
    by = {c.label: c for c in sea.campaign.reference.model.causes}

    def worth(label, numbers, other):
        one = replace(sea.done.decision.named[0], cause=by[label], numbers=np.array(numbers))
        return {
            w.split(",")[0]: next_manoeuvre.separation(trial, g, one, other)
            for w, g in grams.items()
        }

    lag = worth("rudder_lag", [2.0], "rudder_delay")
    assert lag["a drifting stop"] == pytest.approx(0.0, abs=1e-3)
    assert lag["doublets of 3 s at constant revolutions"] > 5.0
    power = worth("thrust_loss", [-0.2], "fouling")
    assert power["full power and no power in turn"] > 1.5 * power["a drifting stop"]
    gyro = worth("yaw_rate_scale", [0.03], "yaw_rate_bias")
    assert gyro["a zigzag"] > 10.0 * gyro["a drifting stop"]
    assert all(v >= -1e-6 for found in (lag, power, gyro) for v in found.values())


def test_a_path_may_follow_a_force_that_comes_and_goes(sea):
    """By twice the acceleration of the process noise and of it together."""
    ref, intermittent = sea.campaign.reference, np.array([0.0, 0.02, 0.01])
    raised = Remainder("raised", channels=(1.0, 2.0, 1.0), intermittent=(0.0, 0.02, 0.01))
    plain, pulsed = ref.allowed_distance(1.5, Remainder()), ref.allowed_distance(1.5, raised)
    assert pulsed.acceleration**2 == pytest.approx(
        (plain.acceleration * (1.0, 2.0, 1.0)) ** 2 + (2.0 * intermittent) ** 2
    )


def test_causes_converge_from_where_they_converged_before(compass):
    """From far away a second time: one linearisation, and the same numbers."""
    trial, decision = compass
    (label,) = labels(decision)
    asked = []

    class Counted(Trial):
        def linearise(self, numbers, *given):
            asked.append(numbers)
            return super().linearise(numbers, *given)

    again, point = as_it_stands.begin(Counted.build(trial.campaign, trial.record), {})
    asked.clear()
    ends = []
    for begin in (0.5, -0.5):
        start = Start({label: np.array([begin])}, point.path)
        found = resume(again, (label,), Remainder(), start).estimate
        ends.append((len(asked), *found.numbers[label]))
        asked.clear()
    assert ends[0][0] > 2 and ends[1][0] == 1
    assert ends[0][1] == pytest.approx(ends[1][1], rel=0.02)


def test_the_models_error_in_the_wind_tells_no_wind_force_from_an_anemometers_scale(sea):
    """A wind that is measured 1.2 times too strong has 1/1.2² of the force that the model gives."""
    trial, scale = sea.done.trial, {"wind_speed_scale": np.array([0.2])}
    force = {"wind_force": np.full(3, 1.2**-2 - 1.0)}
    path = trial.linearise(scale).path
    measured, scaled = trial.linearise(scale, path), trial.linearise(force, path)
    assert measured.linear.cut.factors == trial.linearise({}).linear.cut.factors == {}
    assert scaled.linear.cut.factors["wind"] == pytest.approx(np.full(3, 1.2**-2))
    assert trial.covering(scaled).cut.factors["wind"] == pytest.approx(np.full(3, 1.2**-2))
    one, other = (evidence.level(trial, point, 1.0).value for point in (measured, scaled))
    assert other == pytest.approx(one, abs=np.log(10.0))  # a name needs a probability of 0.9


def test_the_current_is_present_from_the_start(sea):
    """It acts in both trial voyages from their first row on."""
    (cause,) = sea.done.verdict.as_json()["causes"]
    onset = cause["onset"]
    assert onset["from_start"] > 0.9
    assert {"elapsed_s", "low", "high", "voyage", "start_s"} < set(onset)
    assert onset["elapsed_s"] == 0.0 and "off" not in cause
    written = json.loads((sea.work / "out" / "verdict.json").read_text(encoding="utf-8"))
    assert written["causes"][0]["onset"] == onset
    assert not sea.done.courses["current"].onset.while_on


def test_a_season_follows_the_current_through_the_voyages(sea):
    """The same current in both voyages, by the API, with its page and its JSON."""
    found = shiplog.trend(sea.run, sea.store, "trial_*", of=["current"])
    (trend,) = found.trends
    true = truth(sea.case)
    assert [one.voyage for one in trend.voyages] == list(found.voyages)
    for one in trend.voyages:
        assert one.pooled["speed"].value == pytest.approx(true["speed"], rel=0.1)
        assert apart(one.pooled["direction"].value, true["direction"]) < 5.0
        assert one.speed is None  # it is the water, and not the ship
    assert trend.spread.high < 0.5 and trend.slope is None
    written = json.loads(json.dumps(found.json))
    assert [c["name"] for c in written["causes"]] == ["current"]
    assert {v["voyage"] for v in written["voyages"]} == set(found.voyages)
    assert "<svg" in found.shown.page() and "| voyage" in found.text
    with pytest.raises(UsageError, match="current can have no limit"):
        shiplog.trend(sea.run, sea.store, "trial_*", of=["current"], limits={"current": 0.1})
