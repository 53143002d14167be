"""Held-out voyages may refute a cause, or leave it in doubt: two rules for all causes.

The numbers of a hypothesis are fitted without each fold in turn. A cause is refuted if the 90 %
interval of its gain on held-out windows lies below zero, of the error of all of them or of the
typical window's: most of the error may be in a few windows, of which no other is like. The search
then goes on without it, and probabilities are those of the hypotheses that do not contain it. Its
gain is that over the other names, whose numbers are fitted again. If one of them is an alias in the
catalogue (`separated_by`), either may do the work of both: only the two together are refuted. The
windows compare velocities. What does not itself change them, as the clock of the position, they
cannot refute: the loss is that of other numbers. Nor do they refute a force or a property of the
ship next to an unrecorded thruster. They lack its force; the helm answers it, and a rudder that is
too weak would make up for it. The likelihood has the force in its noise.

With a remainder the noise is not that of the likelihood, and a log Bayes factor is no proof. Causes
are then named only if the interval of their joint gain lies above zero, and if they take away MOST
of the held-out error beyond that of the nominal voyages. Otherwise the remainder is the larger part
of the answer, and they are candidates. A remainder so slight that it can be an error of the causes'
own equations puts none in doubt. One cause of several may explain far more than the others do, so
that a remainder is slight next to it alone: each of the others has to have a significant gain of
its own.

Nor is a log Bayes factor a proof of causes that take the place of a refuted one, which was more
probable. Their joint gain has to be significant, too. Next to other named causes, so has the own
gain of each of them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import partial
from typing import Protocol

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses.search import Search
from shiplog.diagnosis.noise.remainder import NOMINAL
from shiplog.diagnosis.verdict import posterior as posteriors
from shiplog.diagnosis.verdict import result as decisions
from shiplog.diagnosis.verdict.decide import decide
from shiplog.diagnosis.verdict.posterior import Posterior
from shiplog.diagnosis.verdict.result import Decision, Named
from shiplog.simulation.error_reduction import Gain

SENSOR = "sensor"  # of a cause's kinds: it does not change how the ship moves
TAKES_A_PLACE = "held-out voyages refute what is more probable"


class Judge(Protocol):
    """Windows on which a decision is judged, its numbers fitted without each fold."""

    def gain(self, decision: Decision) -> Gain:
        """Of what is named over nothing."""
        ...

    def worth(self, rest: Decision, decision: Decision) -> Gain:
        """Of a decision over one with a cause less."""
        ...

    def changes_velocity(self, decision: Decision, one: Named) -> bool:
        """Whether the cause itself changes what is compared."""
        ...

    def share_of_excess(self, gain: Gain) -> float:
        """Of what the error is greater than that of the nominal voyages, the share that a gain
        takes away."""
        ...


def _why_in_doubt(
    search: Search, found: Posterior, decision: Decision, first: Collection[str]
) -> str:
    """Why the likelihood alone is no proof of what is named; empty where it is.

    first   names before any was refuted

    Some remainder is stated, of whatever kind, that is more than an error of the causes'
    equations, and is no device, which has a name and is in the noise of the likelihood; or a name
    takes the place of a refuted one.
    """
    names = [one.cause.name for one in decision.named]
    if not set(names) <= set(first):
        return TAKES_A_PLACE
    if decision.side_force is not None:
        return ""
    best = posteriors.best_with(found, names)
    remains = 1.0 - found.kinds.get(NOMINAL, 0.0)
    if remains >= thresholds.STATED and not posteriors.slight(search.table, best):
        return "the catalogue does not explain all of the trial"
    return ""


def _doubt(
    search: Search, found: Posterior, decision: Decision, first: Collection[str], held: Judge,
    gain: Gain,
) -> str:  # fmt: skip
    """Why nothing is named, with the figure that says so; empty where something is."""
    why = _why_in_doubt(search, found, decision, first)
    if why and not gain.real:
        return (
            f"{why}, so a cause is named only if it significantly reduces the held-out error: "
            f"here by {gain.low:.1%} to {gain.high:.1%}"
        )
    if not why or why == TAKES_A_PLACE or not search.table.parts.share_of_causes:
        return ""
    share = held.share_of_excess(gain)
    if share >= thresholds.MOST:
        return ""
    return (
        f"{why}, and what remains unknown is more than the causes explain: they take away "
        f"{share:.0%} of the error that these voyages have more than the nominal ones"
    )


def _judges(held: Judge, decision: Decision, one: Named) -> bool:
    """Whether held-out windows can refute this cause."""
    lack_force = decision.side_force is not None and one.cause.kind != SENSOR
    return not lack_force and held.changes_velocity(decision, one)


def _refuted(
    asked: Sequence[tuple[Named, Gain]], judges: Callable[[Named], bool]
) -> tuple[frozenset[str], str] | None:
    """Of causes whose whole interval is a loss, and that the windows can judge, the one whose loss
    is most certain, and why; together with another one from which it is hard to separate."""
    worse = [(one, gain, lost) for one, gain in asked if (lost := gain.worse) and judges(one)]
    if not worse:
        return None
    one, gain, (low, high) = min(worse, key=lambda given: given[2][1])
    whose = " of the typical window" if (low, high) == gain.typical else ""
    loss = f"the error{whose} is {-high:.1%} to {-low:.1%} greater"
    name = one.cause.name
    for other in (n.cause for n, _ in asked if n.cause.name != one.cause.name):
        if other.name in one.cause.separated_by or name in other.separated_by:
            return frozenset((name, other.name)), (
                "held-out voyages refute it together with another: "
                f"with both {name} and {other.name} {loss}"
            )
    return frozenset((name,)), f"held-out voyages refute it: with it {loss}"


def _unproved(
    asked: Sequence[tuple[Named, Gain]], first: Collection[str]
) -> tuple[frozenset[str], str] | None:
    """Of causes that take a refuted one's place, next to others, the one that gains least,
    and why; none where the gain of each is significant."""
    unsure = [pair for pair in asked if pair[0].cause.name not in first and not pair[1].real]
    if not unsure or len(asked) == 1:
        return None
    one, worth = min(unsure, key=lambda pair: pair[1].low)
    return frozenset((one.cause.name,)), (
        f"{TAKES_A_PLACE}, so this one is named only if it significantly reduces the "
        f"held-out error: here by {worth.low:.1%} to {worth.high:.1%}"
    )


def _unsure_beside_remainder(
    search: Search, found: Posterior, decision: Decision, asked: Sequence[tuple[Named, Gain]],
    judges: Callable[[Named], bool],
) -> tuple[frozenset[str], str] | None:  # fmt: skip
    """Of several causes the one that gains least of those that a stated remainder is not slight
    next to, that the windows can judge, and whose own gain is not significant; and why."""
    if len(asked) == 1 or decision.side_force is not None:
        return None
    table, best = search.table, posteriors.best_with(found, [n.cause.name for n, _ in asked])
    if 1.0 - found.kinds.get(NOMINAL, 0.0) < thresholds.STATED:
        return None
    unsure = [
        (one, gain) for one, gain in asked
        if not gain.real and judges(one) and not posteriors.slight(table, best, one.cause.name)
    ]  # fmt: skip
    if not unsure:
        return None
    one, worth = min(unsure, key=lambda pair: pair[1].low)
    return frozenset((one.cause.name,)), (
        "the catalogue does not explain all of the trial, so each of several causes is named only "
        "if it significantly reduces the held-out error by itself: here by "
        f"{worth.low:.1%} to {worth.high:.1%}"
    )


def judge(
    search: Search, held: Judge | None
) -> tuple[Decision, Posterior, Gain | None, dict[str, str]]:
    """The decision that held-out voyages leave, its posterior and gain, and name → why refuted.
    Causes in doubt are not named: the decision is that of their remainder, or undecided. If
    held-out voyages confirm no answer, refuted causes keep their probabilities, too, with the
    reasons in the decision.

    Of several causes the one that takes most off the held-out error comes first.
    """
    bans: dict[frozenset[str], str] = {}  # names → why hypotheses with all of them do not count
    first: set[str] | None = None  # names before any is refuted
    while True:
        refuted = {name: why for names, why in bans.items() for name in sorted(names)}
        decision, found = decide(search, refuted)
        named = {one.cause.name for one in decision.named}
        first = named if first is None else first
        kept = {name: why for name, why in refuted.items() if name not in named}
        if held is None or not named:
            return decision, found, None, kept
        gain = held.gain(decision)
        worths = [gain]
        if len(decision.named) > 1:
            reduced = [
                decisions.without_cause(search.table.trial, decision, one) for one in decision.named
            ]
            worths = [held.worth(rest, decision) for rest in reduced]
        asked = list(zip(decision.named, worths, strict=True))
        judges = partial(_judges, held, decision)
        if refutable := (
            _refuted(asked, judges)
            or _unproved(asked, first)
            or _unsure_beside_remainder(search, found, decision, asked, judges)
        ):
            names, why = refutable
            bans[names] = why
            search.exclude(*names)
            continue
        if why := _doubt(search, found, decision, first, held, gain):
            doubted = dict.fromkeys(sorted(named), why)
            if not named <= first:  # held-out voyages confirm no answer: all are listed
                search.table.banned.difference_update(bans)
                doubted, kept = refuted | doubted, {}
            return *decide(search, kept, doubted), None, kept
        order = sorted(asked, key=lambda pair: -pair[1].reduction)
        ordered = replace(decision, named=tuple(one for one, _ in order))
        return ordered, found, gain, kept
