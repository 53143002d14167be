"""Of held-out voyages: what makes the error significantly greater is dropped, and nothing else."""

import math

import numpy as np
import pytest
import straight
import weighed

from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED
from shiplog.diagnosis.verdict.refutation import judge
from shiplog.simulation.error_reduction import Gain

DRAG, LOAD, TWO = ("drag",), ("load",), ("two",)
BETTER, WORSE = (0.1, 0.3), (-0.4, -0.02)
UNSURE, HARDLY = (-0.3, 0.2), (-0.4, 0.001)
RAISED_ALONE = {((), RAISED): 1e-12}  # every search weighs nothing with raised noise


def gain(low: float, high: float) -> Gain:
    return Gain(1.0, 1.0 - 0.5 * (low + high), low, high, 12, {})


class HeldOut:
    """Gains by what is named, and by the name that is taken away; what was tested is kept. Of the
    names that are `hidden` the windows feel nothing. `taken` is the share of the excess over the
    nominal voyages that is taken away."""

    def __init__(self, gains, worths=None, hidden=(), taken=1.0):
        self.gains, self.worths, self.asked, self.hidden = gains, worths or {}, [], hidden
        self.taken = taken

    def share_of_excess(self, gain):
        return self.taken

    def gain(self, decision):
        labels = tuple(one.cause.label for one in decision.named)
        self.asked.append(labels)
        assert len(self.asked) < 20, "it never ends"
        return gain(*self.gains[labels])

    def changes_velocity(self, decision, one):
        return one.cause.label not in self.hidden

    def worth(self, rest, decision):
        kept = {one.cause.label for one in rest.named}
        (gone,) = {one.cause.label for one in decision.named} - kept
        return gain(*self.worths[gone])


@pytest.fixture(scope="module")
def trial():
    return weighed.trial()


def test_without_held_out_voyages_the_decision_stands(trial):
    made = weighed.search(trial, {(DRAG, NOMINAL): 1.0})
    decision, found, gained, refuted = judge(made, None)
    assert [one.cause.label for one in decision.named] == ["drag"]
    assert (gained, refuted) == (None, {})
    assert found.names["drag"] == pytest.approx(1.0)


def test_nothing_named_is_not_held_out(trial):
    held = HeldOut({})
    decision, _, gained, refuted = judge(weighed.search(trial, {((), NOMINAL): 1.0}), held)
    assert (decision.verdict, gained, refuted, held.asked) == ("none", None, {}, [])


@pytest.mark.parametrize("interval", (BETTER, UNSURE, HARDLY))
def test_what_is_not_significantly_worse_stays(trial, interval):
    held = HeldOut({DRAG: interval})
    decision, _, gained, refuted = judge(weighed.search(trial, {(DRAG, NOMINAL): 1.0}), held)
    assert [one.cause.label for one in decision.named] == ["drag"]
    assert (gained.low, gained.high) == interval
    assert refuted == {}


@pytest.mark.parametrize("interval", (UNSURE, HARDLY))
def test_with_a_remainder_an_unsure_gain_names_nothing(trial, interval):
    """The verdict is the remainder's; the cause keeps its probability, with the reason."""
    made = weighed.search(trial, {(DRAG, RAISED): 1.0} | RAISED_ALONE)
    decision, found, gained, refuted = judge(made, HeldOut({DRAG: interval}))
    assert (decision.verdict, decision.named, gained, refuted) == ("unknown", (), None, {})
    assert decision.structure.family == "stochastic"
    assert found.names["drag"] == pytest.approx(1.0)
    assert f"by {interval[0]:.1%} to {interval[1]:.1%}" in decision.rejected["drag"]


def test_a_remainder_of_which_the_kind_is_unsure_asks_for_the_same_proof(trial):
    """Motion or raised noise, neither of them sure: that something remains is."""
    made = weighed.search(trial, {(DRAG, RAISED): 0.5, (DRAG, "motion"): 0.5} | RAISED_ALONE)
    decision, found, _, _ = judge(made, HeldOut({DRAG: UNSURE}))
    assert found.remainder is None and found.kinds[NOMINAL] < 0.01
    assert decision.named == () and "drag" in decision.rejected
    named, _, _, _ = judge(made, HeldOut({DRAG: BETTER}))
    assert [one.cause.label for one in named.named] == ["drag"]


@pytest.mark.parametrize(("adds", "verdict"), [(1.9, "named"), (2.5, "unknown")])
def test_a_remainder_that_adds_little_is_an_error_of_the_equations(trial, adds, verdict):
    """The cause explains 100 nats; a remainder of 2 % is a seventh of its force."""
    made = weighed.search(
        trial, {(DRAG, NOMINAL): 0.01, (DRAG, RAISED): 0.99},
        evidence={(DRAG, NOMINAL): 100.0, (DRAG, RAISED): 100.0 + adds},
    )  # fmt: skip
    decision, found, _, _ = judge(made, HeldOut({DRAG: UNSURE}))
    assert found.remainder == RAISED
    assert decision.verdict == verdict


def test_with_a_remainder_a_sure_gain_names_the_cause(trial):
    held = HeldOut({DRAG: BETTER})
    decision, _, gained, _ = judge(
        weighed.search(trial, {(DRAG, RAISED): 1.0} | RAISED_ALONE), held
    )
    assert (decision.verdict, gained.low) == ("named", BETTER[0])
    assert [one.cause.label for one in decision.named] == ["drag"]


@pytest.mark.parametrize(("taken", "verdict"), [(0.32, "unknown"), (0.49, "unknown"),
                                                (0.5, "named"), (0.9, "named")])  # fmt: skip
def test_no_name_is_given_next_to_a_larger_unknown(trial, taken, verdict):
    """A remainder is stated, and the cause takes away less than half of what these voyages have
    more than the nominal ones: it is a candidate, and the headline is the remainder's."""
    made = weighed.search(trial, {(DRAG, RAISED): 1.0} | RAISED_ALONE)
    decision, found, _, _ = judge(made, HeldOut({DRAG: BETTER}, taken=taken))
    assert (decision.verdict, bool(decision.named)) == (verdict, verdict == "named")
    assert found.names["drag"] > 0.9 and found.remainder == RAISED
    assert ("drag" in decision.rejected) == (verdict == "unknown")
    if verdict == "unknown":
        assert f"they take away {taken:.0%} of the error" in decision.rejected["drag"]


@pytest.mark.parametrize("kind", [NOMINAL, RAISED])
def test_a_small_gain_is_enough_where_no_more_than_an_error_of_the_equations_remains(trial, kind):
    """The rest of the error is what the model has on its nominal voyages, too."""
    made = weighed.search(
        trial, {(DRAG, NOMINAL): 0.01, (DRAG, RAISED): 0.99} if kind == RAISED else
        {(DRAG, NOMINAL): 1.0},
        evidence={(DRAG, NOMINAL): 100.0, (DRAG, RAISED): 101.0},
    )  # fmt: skip
    decision, _, _, _ = judge(made, HeldOut({DRAG: BETTER}, taken=0.2))
    assert decision.verdict == "named"


def test_what_is_significantly_worse_is_dropped_and_the_next_is_judged(trial):
    """The likeliest is refuted; of the rest another is sure, and holds."""
    made = weighed.search(
        trial, {(DRAG, NOMINAL): 0.96, (LOAD, NOMINAL): 0.039, ((), NOMINAL): 1e-4}
    )
    held = HeldOut({DRAG: WORSE, LOAD: BETTER})
    decision, found, gained, refuted = judge(made, held)
    assert held.asked == [DRAG, LOAD]
    assert [one.cause.label for one in decision.named] == ["load"]
    assert found.names == pytest.approx({"load": 0.039 / 0.0391})
    assert gained.high == BETTER[1]
    assert list(refuted) == ["drag"]
    assert "2.0% to 40.0% greater" in refuted["drag"]
    assert decision.rejected["drag"] == refuted["drag"]


def test_what_takes_the_place_of_a_refuted_name_must_prove_itself(trial):
    """The likelihood was no proof of the first, and is none of the second."""
    made = weighed.search(
        trial, {(DRAG, NOMINAL): 0.96, (LOAD, NOMINAL): 0.039, ((), NOMINAL): 1e-4}
    )
    decision, _, gained, refuted = judge(made, HeldOut({DRAG: WORSE, LOAD: UNSURE}))
    assert (decision.verdict, decision.named, gained) == ("undecided", (), None)
    assert decision.rejected["drag"].startswith("held-out voyages refute it")
    assert decision.rejected["load"].startswith("held-out voyages refute what is more probable")
    # neither is confirmed, so each keeps its probability
    assert refuted == {} and decision.ranking["drag"] == pytest.approx(0.96, abs=0.01)
    assert decision.ranking["load"] == pytest.approx(0.039, abs=0.001)


@pytest.mark.parametrize(("own", "named"), [(BETTER, ["drag", "two"]), (UNSURE, ["drag"])])
def test_next_to_other_names_it_must_prove_itself_by_its_own_gain(trial, own, named):
    """Drag gains enough for both. What stands in the place of the load is named for its own gain
    only; without it the others are judged again."""
    both, other = ("drag", "load"), ("drag", "two")
    made = weighed.search(
        trial, {(both, NOMINAL): 0.96, (other, NOMINAL): 0.039, (DRAG, NOMINAL): 1e-4}
    )
    held = HeldOut(
        {both: BETTER, other: BETTER, DRAG: BETTER}, {"drag": BETTER, "load": WORSE, "two": own}
    )
    decision, _, gained, refuted = judge(made, held)
    assert [one.cause.label for one in decision.named] == named
    assert gained.low == BETTER[0]
    assert set(refuted) == {"load", "two"} - set(named)
    reason = decision.rejected.get("two", "")
    assert reason.startswith("held-out voyages refute what is more probable") == (own == UNSURE)


@pytest.mark.parametrize(("which", "alike"), [("drag", "load"), ("load", "drag"), ("two", "drag")])
def test_of_two_aliases_only_both_together_are_refuted(trial, monkeypatch, which, alike):
    """Drag and load together are significantly worse than the load alone, which says nothing of
    drag alone where one can do the other's work. The relation holds whichever of them states it."""
    by = {cause.name: cause for cause in weighed.search(trial, {}).table.catalogue}
    monkeypatch.setattr(type(by[which]), "separated_by", {alike: "a test"}, raising=False)
    made = weighed.search(
        trial, {(("drag", "load"), NOMINAL): 0.9, (DRAG, NOMINAL): 0.09, (LOAD, NOMINAL): 0.001}
    )
    held = HeldOut(
        {("drag", "load"): BETTER, DRAG: BETTER, LOAD: BETTER}, {"drag": WORSE, "load": UNSURE}
    )
    decision, found, _, refuted = judge(made, held)
    told = which == "two"  # it is not there
    assert [one.cause.label for one in decision.named] == (["load"] if told else ["drag"])
    assert list(refuted) == (["drag"] if told else ["load"])
    if not told:
        assert "together with another" in decision.rejected["load"]
        assert "drag" not in decision.rejected
    assert all(set(h.causes) != {"drag", "load"} for h in found.hypotheses)


def test_one_of_two_alike_may_be_refuted_after_both(trial, monkeypatch):
    by = {cause.name: cause for cause in weighed.search(trial, {}).table.catalogue}
    monkeypatch.setattr(type(by["drag"]), "separated_by", {"load": "a test"}, raising=False)
    made = weighed.search(
        trial, {(("drag", "load"), NOMINAL): 0.9, (DRAG, NOMINAL): 0.09, (LOAD, NOMINAL): 0.001}
    )
    held = HeldOut(
        {("drag", "load"): BETTER, DRAG: WORSE, LOAD: BETTER}, {"drag": WORSE, "load": UNSURE}
    )
    decision, _, _, refuted = judge(made, held)
    assert [one.cause.label for one in decision.named] == ["load"]
    assert list(refuted) == ["drag"]


def test_after_two_are_refuted_together_a_remainder_is_no_surer_than_they(trial, monkeypatch):
    by = {cause.name: cause for cause in weighed.search(trial, {}).table.catalogue}
    monkeypatch.setattr(type(by["drag"]), "separated_by", {"load": "a test"}, raising=False)
    made = weighed.search(
        trial, {(("drag", "load"), NOMINAL): 0.97, ((), "time"): 0.02, (DRAG, NOMINAL): 1e-5}
    )
    held = HeldOut({("drag", "load"): BETTER}, {"drag": WORSE, "load": UNSURE})
    decision, _, _, refuted = judge(made, held)
    assert (decision.verdict, decision.named) == ("undecided", ())
    assert set(refuted) == {"drag", "load"} == set(decision.either)
    assert [decision.ranking[name] for name in ("drag", "load")] == [0.5, 0.5]


@pytest.mark.parametrize("joint", [BETTER, UNSURE])
def test_what_gains_nothing_in_a_refuted_place_takes_no_other_name_with_it(trial, joint):
    """Drag was named from the start, and needs no gain that is sure; two, in the place of the load,
    does."""
    both, other = ("drag", "load"), ("drag", "two")
    made = weighed.search(
        trial, {(both, NOMINAL): 0.96, (other, NOMINAL): 0.039, (DRAG, NOMINAL): 1e-4}
    )
    held = HeldOut(
        {both: BETTER, other: joint, DRAG: UNSURE}, {"drag": UNSURE, "load": WORSE, "two": UNSURE}
    )
    decision, _, _, refuted = judge(made, held)
    assert [one.cause.label for one in decision.named] == ["drag"]
    assert set(refuted) == {"load", "two"}


def test_of_several_in_a_refuted_place_each_must_gain(trial):
    pair = ("load", "two")
    made = weighed.search(
        trial, {(DRAG, NOMINAL): 0.96, (pair, NOMINAL): 0.039, (LOAD, NOMINAL): 1e-3}
    )
    held = HeldOut({DRAG: WORSE, pair: BETTER, LOAD: BETTER}, {"load": BETTER, "two": UNSURE})
    decision, _, _, refuted = judge(made, held)
    assert [one.cause.label for one in decision.named] == ["load"]
    assert set(refuted) == {"drag", "two"}


def test_what_was_named_together_with_a_refuted_name_need_not(trial):
    made = weighed.search(trial, {(("drag", "load"), NOMINAL): 0.97, (LOAD, NOMINAL): 0.03})
    held = HeldOut({("drag", "load"): BETTER, LOAD: UNSURE}, {"drag": (-0.5, -0.2), "load": UNSURE})
    decision, _, _, refuted = judge(made, held)
    assert [one.cause.label for one in decision.named] == ["load"]
    assert list(refuted) == ["drag"]


def test_after_a_refutation_the_rest_may_be_undecided(trial):
    made = weighed.search(
        trial, {(DRAG, NOMINAL): 0.96, (LOAD, NOMINAL): 0.02, (TWO, NOMINAL): 0.02}
    )
    decision, _, gained, refuted = judge(made, HeldOut({DRAG: WORSE}))
    assert (decision.verdict, decision.named, gained) == ("undecided", (), None)
    assert list(refuted) == ["drag"]


def test_everything_refuted_ends_with_nothing(trial):
    """Each in turn; it ends after as many rounds as there are names."""
    given = {(labels, NOMINAL): 100.0**-i for i, labels in enumerate((DRAG, LOAD, TWO))}
    clocks = {(("clock:wind",), NOMINAL): 1e-8, (("clock:gnss",), NOMINAL): 1e-9}
    made = weighed.search(trial, given | clocks)
    held = HeldOut({(label,): WORSE for label in ("drag", "load", "two", "clock:wind")})
    decision, found, gained, refuted = judge(made, held)
    assert held.asked == [DRAG, LOAD, TWO, ("clock:wind",)]
    assert (decision.verdict, decision.named, gained) == ("none", (), None)
    assert set(refuted) == {"drag", "load", "two", "clock"}
    assert found.none == pytest.approx(1.0)


def test_of_two_the_one_that_is_worth_least_goes_first(trial):
    """Both are significantly worse; the set without the worse one is judged again, and holds."""
    made = weighed.search(trial, {(("drag", "load"), NOMINAL): 0.97, (LOAD, NOMINAL): 0.03})
    held = HeldOut(
        {("drag", "load"): BETTER, LOAD: BETTER}, {"drag": (-0.5, -0.2), "load": (-0.3, -0.1)}
    )
    decision, _, gained, refuted = judge(made, held)
    assert held.asked == [("drag", "load"), LOAD]
    assert [one.cause.label for one in decision.named] == ["load"]
    assert list(refuted) == ["drag"]
    assert gained.low == BETTER[0]


def test_of_two_each_is_judged_over_the_other_alone(trial):
    """Together they are better than nothing; one is significantly worse than not having it."""
    made = weighed.search(trial, {(("drag", "load"), NOMINAL): 0.97, (DRAG, NOMINAL): 0.03})
    held = HeldOut({("drag", "load"): BETTER, DRAG: BETTER}, {"drag": UNSURE, "load": WORSE})
    decision, _, _, refuted = judge(made, held)
    assert [one.cause.label for one in decision.named] == ["drag"]
    assert list(refuted) == ["load"]


def test_what_the_windows_do_not_feel_they_do_not_refute(trial):
    """The load's numbers are worse together with the drag, and that is not the drag's fault."""
    given = {(("drag", "load"), NOMINAL): 0.97, (LOAD, NOMINAL): 0.03}
    gains, worths = {("drag", "load"): BETTER, LOAD: BETTER}, {"drag": WORSE, "load": UNSURE}
    for hidden, named in (((), ["load"]), (("drag",), ["drag", "load"])):
        held = HeldOut(gains, worths, hidden)
        decision, _, _, refuted = judge(weighed.search(trial, given), held)
        assert sorted(one.cause.label for one in decision.named) == named
        assert list(refuted) == [name for name in ("drag",) if name not in named]


@pytest.mark.parametrize(("kind", "refuted"), [("ship", False), ("sensor", True)])
def test_next_to_an_unrecorded_thruster_windows_refute_faults_of_sensors_only(
    trial, monkeypatch, kind, refuted
):
    """The windows lack its force, and the helm answers it."""
    force = SideForce(0.0, 60.0, 0.3, 4.0, np.array([0.0, 0.01, 0.004]), device=1.0)
    both = {(DRAG, INTERMITTENT): 1.0, ((), INTERMITTENT): 1e-6}
    made = weighed.search(trial, both, side_force=force)
    monkeypatch.setattr(straight.One, "kind", kind)
    decision, _, _, found = judge(made, HeldOut({DRAG: WORSE}))
    assert [one.cause.label for one in decision.named] == ([] if refuted else ["drag"])
    assert decision.side_force is force
    assert set(found) == ({"drag"} if refuted else set())


def test_a_gain_without_bounds_refutes_nothing(trial):
    held = HeldOut({DRAG: (-math.inf, math.nan)})
    decision, _, _, refuted = judge(weighed.search(trial, {(DRAG, NOMINAL): 1.0}), held)
    assert (len(decision.named), refuted) == (1, {})


@pytest.mark.parametrize("first", ("drag", "load"))
def test_what_takes_most_off_the_error_comes_first(trial, first):
    made = weighed.search(trial, {(("drag", "load"), NOMINAL): 1.0})
    worths = {"drag": UNSURE, "load": UNSURE} | {first: BETTER}
    decision, _, _, _ = judge(made, HeldOut({("drag", "load"): BETTER}, worths))
    assert decision.named[0].cause.label == first
    assert {one.cause.label for one in decision.named} == {"drag", "load"}


@pytest.mark.parametrize(
    ("drag", "own", "names"),
    [(100.0, UNSURE, ["load"]), (100.0, BETTER, ["drag", "load"]),
     (600.0, UNSURE, ["drag", "load"])],
)  # fmt: skip
def test_a_large_cause_makes_no_remainder_slight_for_a_small_one(trial, drag, own, names):
    """The remainder adds 10 nats. That is slight next to both together; next to the 100 of the drag
    it is not, so that the drag has to gain by itself. Next to 600 it is an error of equations."""
    both = ("drag", "load")
    load, whole = 900.0, 900.0 + drag
    made = weighed.search(
        trial,
        {(both, RAISED): 0.99, (both, NOMINAL): 0.01, (LOAD, RAISED): 1e-6, (LOAD, NOMINAL): 1e-8,
         (DRAG, NOMINAL): 1e-9},
        evidence={
            (both, RAISED): whole + 10.0, (both, NOMINAL): whole, (LOAD, RAISED): load + 10.0,
            (LOAD, NOMINAL): load, (DRAG, NOMINAL): drag,
        },
    )  # fmt: skip
    held = HeldOut({both: BETTER, LOAD: BETTER}, {"drag": own, "load": BETTER})
    decision, _, _, refuted = judge(made, held)
    assert sorted(one.cause.label for one in decision.named) == names
    assert ("drag" in refuted) == ("drag" not in names)
