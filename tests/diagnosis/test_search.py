"""A search over hypotheses finds what was hidden, whatever the catalogue's order."""

import math
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import pytest
from searchable import raised_noise, search_of, searched, trial_with
from straight import CAUSES, One

from shiplog.diagnosis.hypotheses import evidence, moves, weighing
from shiplog.diagnosis.hypotheses import search as searching
from shiplog.diagnosis.hypotheses import table as hypotheses
from shiplog.diagnosis.hypotheses.search import Search
from shiplog.diagnosis.noise.remainder import NOMINAL, RAISED, Remainder
from shiplog.diagnosis.trial.fitted import Point
from shiplog.diagnosis.verdict import posterior as posteriors
from shiplog.diagnosis.verdict.decide import decide


@pytest.fixture(scope="module")
def one():
    return searched({"drag": [1.2]})


def test_a_hidden_cause_is_found_and_sized(one):
    best = one.table.ranked()[0]
    assert (best.causes, best.kind) == (("drag",), NOMINAL)
    spread = float(np.sqrt(best.estimate.covariance[0, 0]))
    assert best.estimate.numbers["drag"][0] == pytest.approx(1.2, abs=4.0 * spread)
    assert spread < 0.2
    assert (
        one.table.alone["drag"] > 20.0 > max(v for k, v in one.table.alone.items() if k != "drag")
    )
    assert set(one.expected) == {cause.label for cause in CAUSES}
    decision, found = decide(one)
    assert decision.verdict == "named"
    assert [n.cause.label for n in decision.named] == ["drag"]
    assert found.names["drag"] > 0.9


def test_a_cause_whose_fit_diverges_is_no_answer(monkeypatch):
    """Where it is linearised it explains much, and no fit of it holds: neither a name nor a
    probability is left of that, and the reason is reported."""
    before = weighing.resume

    def diverges(trial, included, *more, **others):
        fit = before(trial, included, *more, **others)
        gone = replace(fit, estimate=replace(fit.estimate, evidence=-math.inf))
        return gone if "drag" in included else fit

    monkeypatch.setattr(weighing, "resume", diverges)
    made = searched({"drag": [1.2]})
    assert made.diverged == {"drag"} and made.scanned["drag"] > 20.0
    decision, found = decide(made)
    assert "drag" not in found.ranking()
    assert "it diverges from there" in decision.rejected["drag"]
    assert decision.named == ()


def test_a_cause_is_weighed_however_far_behind_nothing_is(monkeypatch):
    """A remainder may explain a part of what a cause explains wholly, and next to that remainder
    the cause would add nothing."""
    before, added = searching.weigh_remainders, Search._additions

    def absorbs(plain):
        weighed = before(plain)
        if plain.of.labels:
            return weighed
        score = weighed[0].score + 2.0 * searching.SEARCH_NATS
        return [*weighed, replace(weighed[0], remainder=Remainder("position"), score=score)]

    def none_next_to_it(self, one, fit):
        return added(self, one, fit) if one.kind == NOMINAL else []

    monkeypatch.setattr(searching, "weigh_remainders", absorbs)
    monkeypatch.setattr(Search, "_additions", none_next_to_it)
    monkeypatch.setattr(searching, "rescored", lambda table, scale: table)
    best = searched({"drag": [1.2]}).table.ranked()[0]
    assert (best.causes, best.kind) == (("drag",), NOMINAL)


def test_a_cause_is_weighed_that_is_far_from_linear(monkeypatch):
    """Its derivative promises a fifth of what it explains, and a remainder that explains nine
    tenths is weighed before it: a line that drags the ship away, and a force of the place."""
    before, scan, added = searching.weigh_remainders, evidence.scan, Search._additions
    whole = []

    def less(*given):
        level, found = scan(*given)
        whole.extend(one.evidence for one in found)
        return level, [replace(one, evidence=0.2 * one.evidence) for one in found]

    def absorbs(plain):
        if plain.of.labels:
            return before(plain)
        nothing = made.table.nothing
        position = replace(nothing, remainder=Remainder("position"))
        return [replace(position, score=nothing.score + 0.9 * max(whole))]

    def none_next_to_it(self, one, fit):
        return added(self, one, fit) if one.kind == NOMINAL else []

    monkeypatch.setattr(evidence, "scan", less)
    monkeypatch.setattr(Search, "_weigh_ordinary", lambda _: None)  # raised noise explains more
    monkeypatch.setattr(searching, "weigh_remainders", absorbs)
    monkeypatch.setattr(Search, "_additions", none_next_to_it)
    monkeypatch.setattr(searching, "rescored", lambda table, scale: table)
    made = search_of(*trial_with({"drag": [4.0]}))
    made.run()
    best = made.table.ranked()[0]
    assert 0.7 * max(whole) > searching.SEARCH_NATS
    assert (best.causes, best.kind) == (("drag",), NOMINAL)


@dataclass(frozen=True)
class Whole(One):
    """There wholly or not at all."""

    whole = (2.4,)


@pytest.mark.parametrize("cause", [One("drag"), Whole("drag")])
def test_a_cause_that_is_there_wholly_is_looked_at_there(monkeypatch, cause):
    """Half of it is worse than nothing: its derivative promises nothing of it."""
    scan = evidence.scan

    def blind(*given):
        level, found = scan(*given)
        return level, [replace(one, evidence=0.0) if one.name == "drag" else one for one in found]

    monkeypatch.setattr(evidence, "scan", blind)
    monkeypatch.setattr(Search, "_weigh_ordinary", lambda _: None)
    made = search_of(*trial_with({"drag": [1.2]}, causes=(cause, One("load"))))
    made.run()
    best = made.table.ranked()[0]
    assert (best.causes == ("drag",)) == bool(cause.whole)


def test_the_order_of_the_catalogue_does_not_matter(one):
    """The same data with its causes in reverse: the same hypotheses with the same probabilities."""
    other = searched({"drag": [1.2]}, causes=CAUSES[::-1])
    assert set(other.table.found) == set(one.table.found)
    for key, hypothesis in one.table.found.items():
        assert other.table.found[key].score == pytest.approx(hypothesis.score, abs=1e-4)
    assert posteriors.posterior(other).ranking() == pytest.approx(
        posteriors.posterior(one).ranking(), abs=1e-6
    )


@pytest.mark.parametrize("hidden", tuple(combinations(("two", "drag", "load"), 2)), ids="+".join)
def test_two_hidden_causes_are_both_found(hidden):
    sizes = {"two": [1.2, -3.0], "drag": [-1.2], "load": [1.0]}
    found = searched({n: sizes[n] for n in hidden})
    best = found.table.ranked()[0]
    assert best.causes == tuple(sorted(hidden))
    for label in hidden:
        assert np.sign(best.estimate.numbers[label]).tolist() == np.sign(sizes[label]).tolist()
    decision, _ = decide(found)
    assert {n.cause.label for n in decision.named} == set(hidden)
    # either by itself was weighed as well
    assert {((label,), NOMINAL) for label in hidden} <= set(found.table.found)


@pytest.mark.parametrize("likely", [{"drag": [0.9], "load": [0.9]}, {"clock:wind": [0.5]}])
def test_a_likely_set_is_weighed_first_and_decides_nothing(monkeypatch, likely):
    """Right or wrong, the most probable hypothesis is the same one."""
    order, before = [], searching.plain_fit

    def noted(of, *given):
        order.append(of.labels)
        return before(of, *given)

    hidden = {"drag": [1.2], "load": [1.2]}
    whole = searched(hidden).table.ranked()[0]
    monkeypatch.setattr(searching, "plain_fit", noted)
    found = searched(hidden, likely={n: np.array(v) for n, v in likely.items()}).table.ranked()[0]
    assert order[:2] == [(), tuple(sorted(likely))]
    assert (found.causes, found.kind) == (whole.causes, whole.kind) == (("drag", "load"), NOMINAL)
    assert found.score == pytest.approx(whole.score, abs=0.01)


def test_what_leaves_nominal_noise_spares_the_remainders_of_what_is_far_behind():
    """With the hidden cause the process noise is nominal again. Raised noise, a force and a change
    of a family are then estimated of no set that is far behind, until that cause is banned."""
    found = searched({"drag": [4.0]})
    table = found.table
    assert {((), NOMINAL), ((), RAISED)} <= set(table.found)
    assert {kind for labels, kind in table.found if not labels} == {NOMINAL, RAISED}
    assert not table.found[(), RAISED].remainder.shaped
    best = table.ranked()[0]
    assert best.noise_factor < weighing.RAISED_FROM
    every = search_of(*trial_with({"drag": [4.0]}))
    every.weigh((), {}, every.table.first)  # with its remainders
    assert {kind for _, kind in every.table.found} > {NOMINAL, RAISED}
    every.run()
    of = {one.kind: one.score for one in every.table.found.values() if not one.causes}
    assert max(of.values()) < best.score - searching.SEARCH_NATS
    assert every.table.ranked()[0].score == pytest.approx(best.score, abs=0.01)
    shares, spared = posteriors.posterior(every).ranking(), posteriors.posterior(found).ranking()
    assert max(abs(shares.get(n, 0.0) - spared.get(n, 0.0)) for n in {*shares, *spared}) < 1e-4
    found.exclude("drag")
    assert {kind for labels, kind in found.table.found if not labels} > {NOMINAL, RAISED}


def test_nothing_hidden_is_nothing():
    found = searched({})
    assert found.table.ranked()[0].causes == ()
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
    for (labels, kind), hypothesis in less.table.found.items():
        if (labels, kind) in one.table.found and len(labels) < 2:
            off = wanted * ("drag" in labels) + 2.0 * (kind == "position")
            assert one.table.found[labels, kind].score - hypothesis.score == pytest.approx(
                off, abs=1e-3
            )
    gone = searched({"drag": [1.2]}, {"drag": 500.0})
    assert "drag" not in {n for h in gone.table.ranked()[:1] for n in h.causes}


def test_either_of_two_causes_may_exclude_the_other(monkeypatch):
    """The load says that it is in no hypothesis with drag; drag says nothing of the load."""
    (load,) = (cause for cause in CAUSES if cause.label == "load")
    monkeypatch.setattr(type(load), "compatible", lambda self, label: label not in ("load", "drag"))
    found = searched({"drag": [1.2], "load": [1.2]})
    assert (("load",), NOMINAL) in found.table.found and (("drag",), NOMINAL) in found.table.found
    assert not [labels for labels, _ in found.table.found if {"drag", "load"} <= set(labels)]


def test_another_form_takes_the_place_of_one_that_promised_more(monkeypatch):
    """Two clocks that exclude each other, and a scan that never proposes the right one."""
    monkeypatch.setattr(One, "compatible", lambda self, label: label.split(":")[0] != self.name)
    proposed = moves.additions

    def misled(*given):
        return [one for one in proposed(*given) if "clock:gnss" not in one[0]]

    monkeypatch.setattr(moves, "additions", misled)
    found = searched({"clock:gnss": [1.2]}, alike=("clock:wind", "clock:gnss", 0.25))
    assert found.table.ranked()[0].causes == ("clock:gnss",)


def test_an_addition_is_judged_where_it_is_linearised_and_not_by_a_derivative(monkeypatch):
    """A derivative that promises little of the hidden cause and much of another: from nearer the
    gains are those of fits of either."""
    trial, point = trial_with({"drag": [1.2]})
    found = search_of(trial, point)
    found.weigh((), {}, point, later=True)
    nothing = found.table.nothing
    fit, causes = found.table.fit(nothing), found.table.catalogue
    scan = evidence.scan

    def misled(*given):
        base, promised = scan(*given)
        wrong = {"drag": 1.0, "load": 80.0}
        return base, [replace(f, evidence=wrong.get(f.name, -1.0)) for f in promised]

    monkeypatch.setattr(evidence, "scan", misled)
    by_derivative = moves.additions(found.table, nothing, fit, causes)
    assert [labels for labels, _, _ in by_derivative] == [("load",)]
    nearer = moves.additions(found.table, nothing, fit, causes, nearer=True)
    assert nearer[0][0] == ("drag",)
    monkeypatch.setattr(evidence, "scan", scan)
    (of_drag,) = (score for labels, _, score in nearer if labels == ("drag",))
    found.weigh(("drag",), {"drag": np.zeros(1)}, point)
    reached = found.table.scale.score(
        found.table.found[("drag",), NOMINAL].evidence, ("drag",), NOMINAL
    )
    assert of_drag == pytest.approx(reached, abs=2.0)
    monkeypatch.setattr(trial.__class__, "linearise", diverging)
    assert moves.additions(found.table, nothing, fit, causes, nearer=True) == []


def diverging(*given):
    raise np.linalg.LinAlgError


def test_what_is_banned_together_stays_alone(monkeypatch):
    found = search_of(*trial_with({"drag": [1.2], "load": [1.2]}))
    found.table.banned.add(frozenset(("drag", "load")))
    found.run()
    assert not [labels for labels, _ in found.table.found if {"drag", "load"} <= set(labels)]
    assert {("drag",), ("load",)} & {h.causes for h in found.table.ranked()[:4]}


def test_what_a_model_has_already_stays_with_what_is_found():
    """An extended model: its own cause stands at its numbers in every hypothesis."""
    found = searched({"drag": [1.2], "load": [1.0]}, fixed={"drag": [1.2]})
    best = found.table.ranked()[0]
    assert best.causes == ("load",)
    assert not [labels for labels, _ in found.table.found if "drag" in labels]
    for hypothesis in found.table.found.values():
        assert hypothesis.estimate.numbers["drag"] == pytest.approx([1.2], abs=1e-4)
    decision, _ = decide(found)
    assert [n.cause.label for n in decision.named] == ["load"]
    assert decision.named[0].numbers == pytest.approx(best.estimate.numbers["load"])
    spread = np.sqrt(decision.named[0].covariance[0, 0])
    assert decision.named[0].numbers[0] == pytest.approx(1.0, abs=4.0 * spread)


def test_a_set_with_one_cause_less_is_fitted_again_with_the_same_noise():
    """Its own noise was less probable, so what it lacks is no evidence for the cause."""
    trial, point = trial_with({"drag": [1.2]}, accelerations=raised_noise())
    found = search_of(trial, point)
    found.run()
    kept = {k: h for k, h in found.table.found.items() if k[0] in (("drag",), ("drag", "load"))}
    best = replace(kept[("drag",), RAISED], causes=("drag", "load"))
    wrong = replace(best.remainder, channels=(9.0, 1.0, 1.0), noise_lasts=4.0)
    lost = {"evidence": best.evidence - 50.0, "score": best.score - 50.0}
    before = replace(kept[("drag",), RAISED], remainder=wrong, **lost)
    fit = found.table.fit(replace(best, causes=("drag",)))
    shaped = replace(best, remainder=replace(best.remainder, channels=(3.2, 3.2, 3.3)))
    of = found.cause_set(("drag",))
    again = weighing.weigh_as(of, shaped, fit, before)
    assert again is not None and again.remainder == shaped.remainder
    assert again.evidence == pytest.approx(best.evidence, abs=15.0)
    assert weighing.weigh_as(of, shaped, fit, again) is None  # it gains no more
    plain = replace(best, remainder=Remainder(RAISED))
    assert weighing.weigh_as(of, plain, fit, again) is None


def test_a_force_of_the_place_is_unknown_and_depends_on_position():
    """No cause has it: it is not named, and the kind of what remains is."""
    plain, point = trial_with({})
    family = next(f for f in plain.omitted.families if f.name == "position")
    rng = np.random.default_rng(5)
    weights = np.zeros(plain.omitted.count)
    first = plain.omitted.families[0].columns[0]
    weights[family.columns - first] = 9.0 * rng.standard_normal(len(family.columns))
    accelerations = plain.omitted.accelerations(point.linear.cut, plain.grid) @ weights
    found = searched({}, accelerations=accelerations)
    decision, weighed = decide(found)
    assert decision.named == ()
    assert decision.verdict == "unknown"
    assert decision.structure.family == "position"
    assert weighed.kinds["position"] > 0.9
    assert next(iter(decision.ranking)) == "unknown:position"


def test_without_a_cause_the_search_goes_on_to_what_stood_behind_it(monkeypatch):
    """One contender at a time, and two causes hidden, one of them with half the columns of a third:
    without the strongest the third is weighed, which was not worth a look together with it."""
    monkeypatch.setattr(moves, "CONTENDERS", 1)
    found = searched({"drag": [1.2]}, alike=("drag", "load", 0.7))
    assert found.table.ranked()[0].causes == ("drag",)
    weighed = {h.causes for h in found.table.ranked()}
    assert ("load",) not in weighed
    found.exclude("drag")
    assert found.table.ranked()[0].causes == ("load",)
    assert found.table.found.best(NOMINAL, found.table.banned).causes == ("load",)
    assert all("drag" not in h.causes for h in posteriors.posterior(found).hypotheses)
    assert set(found.scanned) == {c.label for c in CAUSES}


@pytest.mark.parametrize("kept", [1, 2])
def test_what_is_far_behind_keeps_its_place_and_not_its_linearisation(monkeypatch, kept):
    """The same hypotheses, with the same scores, and the same decision."""
    whole = searched({"drag": [1.2], "load": [1.2]})
    monkeypatch.setattr(hypotheses, "KEPT_LINEARISATIONS", kept)
    found = searched({"drag": [1.2], "load": [1.2]})
    linearised = {id(h.point) for h in found.table.found.values() if isinstance(h.point, Point)}
    assert len(linearised) == kept < len({id(h.point) for h in whole.table.found.values()})
    assert {key: h.score for key, h in found.table.found.items()} == pytest.approx(
        {key: h.score for key, h in whole.table.found.items()}
    )
    assert isinstance(found.table.nothing.point, Point)
    far = next(h for h in found.table.ranked()[::-1] if h.causes)
    assert set(found.table.fit(far).point.numbers) == set(far.causes)
    (one, _), (other, _) = decide(found), decide(whole)
    named = {n.cause.label: n.numbers for n in other.named}
    assert {n.cause.label for n in one.named} == set(named) == {"drag", "load"}
    for cause in one.named:
        assert cause.numbers == pytest.approx(named[cause.cause.label])
