"""A search over hypotheses finds what was hidden, whatever the catalogue's order."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import straight
from straight import CAUSES

from shiplog.diagnosis import posterior as posteriors
from shiplog.diagnosis import search as searching
from shiplog.diagnosis.decide import decide
from shiplog.diagnosis.fitted import Point
from shiplog.diagnosis.search import Search
from shiplog.diagnosis.trial import INTERMITTENT, NOMINAL, Remainder
from shiplog.diagnosis.unrecorded_thruster import Pulses

TOLD = 0.6
NOMINAL_SEED, TRIAL_SEED = 1, 2


def numbers_of(columns, hidden) -> np.ndarray:
    whole = np.zeros(columns.linearised)
    for label, values in hidden.items():
        whole[columns.of[label]] = values
    return whole


def trial_with(hidden, causes=CAUSES, fixed=None, alike=None, **changes):
    """A trial with these numbers (SI), and its first point.

    alike   two labels whose columns are the same, but for a share of the second one's own
    """
    columns = straight.columns_of(causes)
    nominal, record = straight.sailed(12), straight.sailed(8, seed=3)
    usual = straight.campaign(
        nominal, straight.passed(nominal, columns, seed=NOMINAL_SEED, told=TOLD), columns
    )
    given = straight.passed(record, columns, seed=TRIAL_SEED, told=TOLD, **changes)
    if alike is not None:
        one, other, share = alike
        j = given.j.copy()
        j[..., columns.of[other]] *= share
        j[..., columns.of[other]] += j[..., columns.of[one]]
        given = replace(given, j=j)
    given = replace(given, e=given.e + given.j @ numbers_of(columns, hidden))
    trial = straight.Straight(usual, record, given, tuple(fixed or {}))
    return trial, trial.begin({n: np.asarray(v) for n, v in (fixed or {}).items()})


def searched(hidden, placebo=None, banned=(), **setting) -> Search:
    trial, point = trial_with(hidden, **setting)
    found = Search(trial, point, placebo or {}, banned)
    found.run()
    return found


@pytest.fixture(scope="module")
def one():
    return searched({"drag": [1.2]})


def test_a_hidden_cause_is_found_and_sized(one):
    best = one.ranked()[0]
    assert (best.causes, best.kind) == (("drag",), NOMINAL)
    spread = float(np.sqrt(best.found.covariance[0, 0]))
    assert best.found.numbers["drag"][0] == pytest.approx(1.2, abs=4.0 * spread)
    assert spread < 0.2
    assert one.alone["drag"] > 20.0 > max(v for k, v in one.alone.items() if k != "drag")
    assert set(one.told) == {cause.label for cause in CAUSES}
    decision, found = decide(one)
    assert decision.verdict == "named"
    assert [n.cause.label for n in decision.named] == ["drag"]
    assert found.names["drag"] > 0.9


def test_the_order_of_the_catalogue_does_not_matter(one):
    """The same data with its causes in reverse: the same hypotheses with the same probabilities."""
    other = searched({"drag": [1.2]}, causes=CAUSES[::-1])
    assert set(other.found) == set(one.found)
    for key, hypothesis in one.found.items():
        assert other.found[key].score == pytest.approx(hypothesis.score, abs=1e-4)
    assert posteriors.posterior(other).ranking() == pytest.approx(
        posteriors.posterior(one).ranking(), abs=1e-6
    )


@pytest.mark.parametrize("hidden", tuple(combinations(("two", "drag", "load"), 2)), ids="+".join)
def test_two_hidden_causes_are_both_found(hidden):
    sizes = {"two": [1.2, -3.0], "drag": [-1.2], "load": [1.0]}
    found = searched({n: sizes[n] for n in hidden})
    best = found.ranked()[0]
    assert best.causes == tuple(sorted(hidden))
    for label in hidden:
        assert np.sign(best.found.numbers[label]).tolist() == np.sign(sizes[label]).tolist()
    decision, _ = decide(found)
    assert {n.cause.label for n in decision.named} == set(hidden)
    # the set without either was weighed as well
    assert {((label,), NOMINAL) for label in hidden} & set(found.found)


def test_nothing_hidden_is_nothing():
    found = searched({})
    assert found.ranked()[0].causes == ()
    decision, weighed = decide(found)
    assert not decision.named
    assert max(weighed.names.values(), default=0.0) < 0.5
    assert weighed.none > 0.5


def test_causes_that_look_alike_share_the_probability():
    """The two cannot be distinguished: neither is named, and their sum is sure."""
    found = searched({"drag": [1.2]}, alike=("drag", "load", 0.02))
    decision, weighed = decide(found)
    assert weighed.names["drag"] + weighed.names["load"] > 0.9
    assert 0.1 < weighed.names["drag"] < 0.9
    assert decision.named == ()
    assert decision.verdict == "undecided"


def test_a_placebo_is_taken_off(one):
    """What a nominal voyage has of a cause is subtracted from what the trial has of it."""
    wanted = 3.0
    less = searched({"drag": [1.2]}, {"drag": wanted, "position": 2.0})
    for (labels, kind), hypothesis in less.found.items():
        if (labels, kind) in one.found and len(labels) < 2:
            off = wanted * ("drag" in labels) + 2.0 * (kind == "position")
            assert one.found[labels, kind].score - hypothesis.score == pytest.approx(off, abs=1e-3)
    gone = searched({"drag": [1.2]}, {"drag": 500.0})
    assert "drag" not in {n for h in gone.ranked()[:1] for n in h.causes}


def test_what_is_banned_is_not_in_any_hypothesis():
    found = searched({"drag": [1.2]}, banned=("drag",))
    assert not [labels for labels, _ in found.found if "drag" in labels]
    assert "drag" not in found.priors.each


def test_what_a_model_has_already_stays_beside_what_is_found():
    """An extended model: its own cause stands at its numbers in every hypothesis."""
    found = searched({"drag": [1.2], "load": [1.0]}, fixed={"drag": [1.2]})
    best = found.ranked()[0]
    assert best.causes == ("load",)
    assert not [labels for labels, _ in found.found if "drag" in labels]
    for hypothesis in found.found.values():
        assert hypothesis.found.numbers["drag"] == pytest.approx([1.2], abs=1e-4)
    decision, _ = decide(found)
    assert [n.cause.label for n in decision.named] == ["load"]
    assert decision.named[0].numbers == pytest.approx(best.found.numbers["load"])
    spread = np.sqrt(decision.named[0].covariance[0, 0])
    assert decision.named[0].numbers[0] == pytest.approx(1.0, abs=4.0 * spread)


def pushes() -> np.ndarray:
    """[S, 3J] three times the nominal process noise."""
    plain, _ = trial_with({})
    kernel = np.linalg.cholesky(straight.PROCESS_NOISE.kernel(plain.grid.knots))
    return 3.0 * np.random.default_rng(6).standard_normal((8, len(kernel))) @ kernel.T


def test_an_intermittent_force_is_asked_for_beside_no_family():
    """Where the process noise is raised, whatever was tried before it."""
    asked = []

    def intermittent(point, base):
        asked.append(trial.remainder)
        return straight.Straight.intermittent(trial, point, base)

    more = pushes()
    for gain, last in ((0.0, None), (1e4, "time")):  # no family is near, or the last of them is
        asked.clear()
        trial, point = trial_with({}, pushed=more)
        trial.intermittent = intermittent
        real = trial.changed
        trial.changed = lambda p, level, labels, family, real=real, gain=gain, last=last: (
            (gain, 3.0) if family == last else real(p, level, labels, family)
        )
        found = Search(trial, point, {})
        found.weigh((), {}, point)
        assert found.found[(), "raised"].found.noise_factor > 1.5
        assert asked == [Remainder(INTERMITTENT)]
        assert ((), INTERMITTENT) not in found.found  # it gains nothing: it is raised noise


@pytest.mark.parametrize("gain", [40.0, -1.0])
def test_an_intermittent_force_is_a_hypothesis_where_it_gains_more_than_raised_noise(gain):
    trial, point = trial_with({}, pushed=pushes())
    trial.intermittent = lambda point, base: Pulses(0.0, gain, 0.0, 1.0, np.zeros(3))
    found = Search(trial, point, {})
    found.weigh((), {}, point)
    if gain < 0.0:
        assert ((), INTERMITTENT) not in found.found
        return
    one, raised = found.found[(), INTERMITTENT], found.found[(), "raised"]
    assert one.evidence - raised.evidence == pytest.approx(gain)
    assert one.score - raised.score == pytest.approx(gain)


@pytest.mark.parametrize(("gain", "noisy"), [(2.0, False), (60.0, True)])
def test_beside_raised_noise_a_family_counts_where_it_alone_is_likelier_than_the_noise(gain, noisy):
    """What gains a little beside noise that explains much is fitted to that noise."""
    trial, point = trial_with({}, pushed=pushes())
    trial.campaign = replace(trial.campaign, noise=0.05)  # its parts have the same noise
    trial.changed = lambda p, level, labels, family: (gain, 3.0)
    found = Search(trial, point, {})
    trial.remainder = Remainder("raised")
    levels = found.levels_of(point, (), 1.0)
    raised = max(level.value for level in levels)
    usual = max(
        level.value
        - trial.expected(level.noise_factor, Remainder("raised"))
        + trial.expected(level.noise_factor, Remainder())
        for level in levels
    )
    assert usual + 2.0 < raised < usual + 60.0
    change = found.changed(point, (), levels, "time")
    assert change.remainder == Remainder("time", 3.0, noisy)
    assert change.value == pytest.approx((raised if noisy else usual) + gain)


def test_a_force_of_the_place_is_unknown_and_depends_on_position():
    """No cause has it: it is not named, and the kind of what remains is."""
    plain, point = trial_with({})
    family = next(f for f in plain.unseen.families if f.name == "position")
    rng = np.random.default_rng(5)
    weights = np.zeros(plain.unseen.count)
    first = plain.unseen.families[0].columns[0]
    weights[family.columns - first] = 9.0 * rng.standard_normal(len(family.columns))
    pushed = plain.unseen.pushed(point.linear.cut, plain.grid) @ weights
    found = searched({}, pushed=pushed)
    decision, weighed = decide(found)
    assert decision.named == ()
    assert decision.verdict == "unknown"
    assert decision.structure.family == "position"
    assert weighed.kinds["position"] > 0.9
    assert next(iter(decision.ranking)) == "unknown:position"


def test_without_a_cause_the_search_goes_on_to_what_stood_behind_it(monkeypatch):
    """One contender at a time, and two causes hidden, one of them with half the columns of a third:
    without the strongest the third is weighed, which was not worth a look beside it."""
    monkeypatch.setattr(searching, "CONTENDERS", 1)
    found = searched({"drag": [1.2]}, alike=("drag", "load", 0.7))
    assert found.ranked()[0].causes == ("drag",)
    weighed = {h.causes for h in found.ranked()}
    assert ("load",) not in weighed
    found.without("drag")
    assert all("drag" not in h.causes for h in found.ranked())
    assert found.ranked()[0].causes == ("load",)
    assert set(found.scanned) == {c.label for c in CAUSES}


def test_without_a_cause_the_process_noise_is_the_usual_one_again():
    """A verdict leaves its pulses in the trial's process noise; the next search begins without."""
    found = searched({"drag": [1.2]})
    trial = found.trial
    usual = trial.process_noise
    trial.process_noise = replace(usual, pulse=np.array([0.0, 0.02, 0.0]))
    found.without("load")
    assert trial.process_noise is trial.reference.process_noise is usual
    again = searched({"drag": [1.2]})
    again.without("load")
    assert {key: h.score for key, h in found.found.items()} == pytest.approx(
        {key: h.score for key, h in again.found.items()}
    )


@pytest.mark.parametrize("kept", [1, 2])
def test_what_is_far_behind_keeps_its_place_and_not_its_linearisation(monkeypatch, kept):
    """The same hypotheses, with the same scores, and the same decision."""
    whole = searched({"drag": [1.2], "load": [1.2]})
    monkeypatch.setattr(searching, "KEPT_LINEARISATIONS", kept)
    found = searched({"drag": [1.2], "load": [1.2]})
    linearised = {id(h.point) for h in found.found.values() if isinstance(h.point, Point)}
    assert len(linearised) == kept < len({id(h.point) for h in whole.found.values()})
    assert {key: h.score for key, h in found.found.items()} == pytest.approx(
        {key: h.score for key, h in whole.found.items()}
    )
    assert isinstance(found.nothing.point, Point)
    far = next(h for h in found.ranked()[::-1] if h.causes)
    assert set(found.point(far).numbers) == set(far.causes)
    (one, _), (other, _) = decide(found), decide(whole)
    named = {n.cause.label: n.numbers for n in other.named}
    assert {n.cause.label for n in one.named} == set(named) == {"drag", "load"}
    for cause in one.named:
        assert cause.numbers == pytest.approx(named[cause.cause.label])
