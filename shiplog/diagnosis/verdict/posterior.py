"""Probabilities of causes and remainders, and the verdict that they allow.

P(cause) is the sum over all hypotheses that contain it, each times the probability that its numbers
are then of practical size. A cause is named where that is at least `thresholds.STATED`; otherwise a
kind of remainder is, or nothing, or the verdict is undecided.

    p_h = exp(score_h)/Σ exp(score),   P(cause) = Σ_h p_h P_h(cause is practical)
    P(kind) = Σ_{h of that kind} p_h,  P(none) = Σ_{h nominal} p_h Π_causes (1 - P_h(practical))

Causes that were only scanned have the weights w_i = exp(score_i - max)/Σ_weighed exp(score - max).
No change is stated where P(none) is probable enough next to those that these data favour, of a log
Bayes factor above 0 against no change, and where the data exclude at least half of what all causes
had before any data:

    P(none)/(1 + Σ_favoured w) ≥ STATED,   (1 - P)/P ≤ MOST (1 - π)/π,   P = P(none)/(1 + Σ w)

with π = NO_CHANGE: P is at least two thirds.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Container, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses.hypothesis import Hypothesis, holds_one, name_of
from shiplog.diagnosis.hypotheses.search import Search
from shiplog.diagnosis.hypotheses.table import Hypotheses
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED
from shiplog.diagnosis.verdict.result import REFUTED, SIDE_THRUST
from shiplog.models.causes.base import deviations
from shiplog.ship_profile.profile import Profile

STOCHASTIC = "stochastic"  # the contract's word for raised process noise
FAMILY = {RAISED: STOCHASTIC}
DRAWS = 400  # of a cause's numbers; a probability of 0.9 is then known to 0.015
# Ship lengths, within which a force and a recorded unit are at one place: side thrusters of a ship
# are further from each other, and a force's place is known to some hundredths.
SAME_PLACE = 0.1
ATHWART = 0.5  # of a fixed thruster's force: its part to the side, from which on it pushes athwart
CERTAIN_NATS = 300.0  # of a cause that was only scanned: more decides no more, and overflows


@dataclass(frozen=True)
class Posterior:
    """What the weighed hypotheses say together.

    hypotheses   best first, with their probabilities [H]
    names        name of a cause → probability that it acts, and is of practical size
    labels       the same of each of its kinds, such as each clock
    kinds        kind of remainder → probability; noise raised by little counts as nominal
    none         probability that nothing of practical size changed
    one_of       names, each too improbable to be stated, one of which at least acts: that is
                 probable enough
    hidden       name → weight, relative to all these hypotheses, of causes that were only scanned
    favoured     their part Σ w that these data favour over no change
    """

    hypotheses: tuple[Hypothesis, ...]
    probability: np.ndarray
    names: Mapping[str, float]
    labels: Mapping[str, float]
    kinds: Mapping[str, float]
    none: float
    hidden: Mapping[str, float]
    one_of: tuple[str, ...] = ()
    favoured: float = 0.0

    @property
    def stated(self) -> tuple[str, ...]:
        """Names that are probable enough to be stated."""
        return tuple(n for n, p in self.names.items() if p >= thresholds.STATED)

    def states(self, label: str) -> bool:
        """Whether one kind of a stated cause belongs to the verdict: the likeliest, and others
        that are probable enough by themselves."""
        same = {n: p for n, p in self.labels.items() if name_of(n) == name_of(label)}
        own = same.get(label, 0.0)
        return own >= thresholds.STATED or own == max(same.values(), default=0.0)

    @property
    def none_of_all(self) -> float:
        """P(none)/(1 + Σ hidden): probability that nothing changed, as the ranking has it: causes
        that these data would hardly show keep what they had before any data."""
        return self.none / (1.0 + sum(self.hidden.values()))

    @property
    def states_none(self) -> bool:
        """Whether no change is stated, as the module says."""
        before = (1.0 - thresholds.NO_CHANGE) / thresholds.NO_CHANGE
        left = 1.0 - self.none_of_all
        return (
            self.none / (1.0 + self.favoured) >= thresholds.STATED
            and left <= thresholds.MOST * before * self.none_of_all
        )

    @property
    def remainder(self) -> str | None:
        """The kind of remainder that is probable enough to be stated; none for `nominal`."""
        found = [k for k, p in self.kinds.items() if k != NOMINAL and p >= thresholds.STATED]
        return found[0] if found else None

    def ranking(
        self, either: Collection[str] = (), why: str = "", device: float = 0.0
    ) -> dict[str, float]:
        """Every answer with its probability over 1 + Σ hidden, likeliest first. Causes that these
        data would hardly show were not weighed one by one: of "none" they keep what they had before
        any data.

        either   names of causes that act, or else the remainder does: each has half
        why      REFUTED: held-out voyages refute `either`; all that is left without has half
        device   probability that an intermittent force is that of one device
        """
        half, rest = (0.5 if either else 1.0), (0.5 if why == REFUTED else 1.0)
        of = {
            f"unknown:{FAMILY.get(k, k)}": half * p for k, p in self.kinds.items() if k != NOMINAL
        }
        if device and INTERMITTENT in self.kinds:
            force = of.pop(f"unknown:{INTERMITTENT}")
            of[SIDE_THRUST] = device * force
            of |= {f"unknown:{INTERMITTENT}": (1.0 - device) * force} if device < 1.0 else {}
        of |= {n: half * p if n in either else rest * p for n, p in self.names.items()}
        of |= dict.fromkeys(either if why == REFUTED else (), half)
        of["none"] = rest * self.none
        whole = 1.0 + sum(self.hidden.values())
        for name, p in self.hidden.items():
            of[name] = of.get(name, 0.0) + p
        return dict(sorted(((n, p / whole) for n, p in of.items()), key=lambda pair: -pair[1]))


def posterior(search: Search) -> Posterior:
    """p_h = exp(score_h - max)/Σ exp(score - max) of the weighed hypotheses, without those that are
    banned; P of names, kinds and none, and the weights w of causes that were only scanned, as the
    module's equations."""
    kept = search.table.ranked()
    score = np.array([h.score for h in kept])
    share = np.exp(score - score.max())
    share /= share.sum()
    names: dict[str, float] = {}
    labels: dict[str, float] = {}
    kinds: dict[str, float] = {}
    none = 0.0
    large_in: list[dict[str, float]] = []
    for one, p in zip(kept, share, strict=True):
        real = practical(search.table, one)
        by_name: dict[str, float] = {}
        for label, large in real.items():
            labels[label] = labels.get(label, 0.0) + float(p) * large
            by_name[name_of(label)] = max(by_name.get(name_of(label), 0.0), large)
        large_in.append(by_name)
        for name, large in by_name.items():
            names[name] = names.get(name, 0.0) + float(p) * large
        kind = practical_kind(search.table, one)
        kinds[kind] = kinds.get(kind, 0.0) + float(p)
        if kind == NOMINAL:
            none += float(p) * math.prod(1.0 - large for large in by_name.values())
    names = {name: p for name, p in names.items() if p > 0.0}
    weight = float(np.exp(score - score.max()).sum())
    most = score.max() + CERTAIN_NATS
    hidden: dict[str, float] = {}
    favoured = 0.0
    weighed = {h.causes for h in kept} | {(label,) for label in search.diverged}
    for label, one in search.scanned.items():
        if not holds_one(search.table.banned, (label,)) and (label,) not in weighed:
            name = name_of(label)
            p = float(np.exp(min(one, most) - score.max())) / weight
            hidden[name] = hidden.get(name, 0.0) + p
            favoured += p if search.table.alone[label] > 0.0 else 0.0
    order = sorted(names, key=lambda name: -names[name])
    names = {n: names[n] for n in order}
    one_of = _alternatives(names, large_in, share)
    return Posterior(tuple(kept), share, names, labels, kinds, none, hidden, one_of, favoured)


def _alternatives(
    names: Mapping[str, float], large_in: Sequence[Mapping[str, float]], share: np.ndarray
) -> tuple[str, ...]:
    """The fewest of the likeliest unstated names with 1 - Σ_h p_h Π_names (1 - P_h(practical)) of
    STATED at least: one of them acts with the stated probability."""
    group: list[str] = []
    for name in (n for n, p in names.items() if p < thresholds.STATED):
        group.append(name)
        without = [math.prod(1.0 - large.get(n, 0.0) for n in group) for large in large_in]
        if 1.0 - float(share @ np.array(without)) >= thresholds.STATED:
            return tuple(group)
    return ()


def practical(table: Hypotheses, one: Hypothesis) -> dict[str, float]:
    """Label → P_h(practical): the share of DRAWS of x ~ N(x̂, V), its numbers in this hypothesis
    [SI], that are large enough to matter."""
    if not table.parts.practical_size:
        return dict.fromkeys(one.causes, 1.0)
    reference, covariance = table.trial.reference, one.estimate.covariance
    found, at = {}, 0
    for label, numbers in one.estimate.numbers.items():
        part = slice(at, at + len(reference.columns.indices[label]))
        at = part.stop
        if label not in one.causes:
            continue
        drawn = np.asarray(numbers)[None]
        if covariance is not None:
            drawn = drawn + _deviations(covariance[part, part])
        found[label] = float(np.mean(table.by[label].practical(drawn, reference.setting)))
    return found


def _deviations(covariance: np.ndarray) -> np.ndarray:
    """V^½ t [DRAWS, n], as `deviations`; none where a fit far behind has no covariance any more.
    Gaussian, as the evidence is."""
    try:
        return deviations(covariance, math.inf, DRAWS)
    except np.linalg.LinAlgError:
        return np.zeros((1, len(covariance)))


def practical_kind(table: Hypotheses, one: Hypothesis) -> str:
    """Its kind of remainder; nominal where that is nothing to act on.

    Process noise as on an ordinary day is nominal. So is a force at one place that varies as noise
    does and is no larger: gusts act at one place, and increase with the wind. Noise that no
    ordinary day has is raised, under whatever prior it was weighed. A force at the place of a unit
    that one of the causes is in is what that cause's equations leave. So is a change of a family
    that is probable only next to causes of no practical size."""
    if one.kind in table.trial.families:
        return NOMINAL if _beside_traces(table, one) else one.kind
    if one.kind not in (NOMINAL, RAISED, INTERMITTENT) or device(table, one):
        return one.kind
    acceleration = table.trial.reference.process_noise.acceleration
    factor = one.remainder.factor_with_force(one.estimate.noise_factor, acceleration)
    ordinary = thresholds.ORDINARY_NOISE if table.parts.ordinary_noise else 1.0
    if table.parts.ordinary_spreads:
        spread = thresholds.ORDINARY_SPREADS * table.trial.nominal_spread
        ordinary = max(ordinary, math.exp(spread))
    if factor < ordinary or (one.kind == INTERMITTENT and _at_a_unit_of_a_cause(table, one)):
        return NOMINAL
    return RAISED if one.kind == NOMINAL else one.kind


def _beside_traces(table: Hypotheses, one: Hypothesis) -> bool:
    """Whether a change of a family is less probable than none, next to those causes alone of the
    hypothesis that are more likely than not of practical size."""
    large = practical(table, one)
    matter = tuple(n for n in one.causes if large.get(n, 1.0) >= 0.5)
    if matter == one.causes:
        return False
    with_change, without = (table.found.get((matter, kind)) for kind in (one.kind, NOMINAL))
    return with_change is not None and without is not None and with_change.score < without.score


def device(table: Hypotheses, one: Hypothesis) -> float:
    """Probability that what remains is an intermittent force, and that of one device which is not
    recorded: by its pattern, or else whether a course that is on or off is more probable."""
    force = one.side_force
    if one.kind != INTERMITTENT or force is None or _at_a_unit_of_a_cause(table, one):
        return 0.0
    return force.device if table.parts.pattern else float(force.course is not None)


def _at_a_unit_of_a_cause(table: Hypotheses, one: Hypothesis) -> bool:
    """Whether the intermittent force of a hypothesis acts at the place of a recorded unit that can
    push athwart, and that one of its causes is in, or where one of its causes pushes athwart now
    and then: two names for one fault."""
    if one.side_force is None:
        return False
    profile = table.trial.record.profile
    length, lever = profile.ship.length_m, abs(one.side_force.lever)
    within = [table.by[n].pushes_within for n in one.causes if n in table.by]
    if any(w > 0.0 and lever < (w + SAME_PLACE) * length for w in within):
        return True
    units = {i for n in one.causes if n in table.by for i in table.by[n].orders(profile) or ()}
    near = SAME_PLACE * length
    return any(
        abs(a.position_m[0] - one.side_force.lever) < near
        for a in (profile.actuators[i] for i in units)
        if a.kind in ("rudder", "azimuth") or abs(math.sin(math.radians(a.direction_deg))) > ATHWART
    )


def share_of_causes(table: Hypotheses, one: Hypothesis, causes: Sequence[str]) -> float:
    """max over kinds of (log Z_causes - log Z_nothing)/(log Z_h - log Z_nothing): of what a
    hypothesis h explains beyond nothing, the share that these of its causes explain, over nothing
    with nominal, or with raised process noise. What raised noise explains no cause does, nor what a
    force explains that counts as such. Nothing, where these causes alone were not weighed."""
    shares, kinds = [], {NOMINAL, RAISED}
    if practical_kind(table, one) == NOMINAL:
        kinds.add(one.kind)
    for kind in kinds:
        nothing, alone = table.found.get(((), kind)), table.found.get((tuple(causes), kind))
        if nothing is not None and one.evidence > nothing.evidence:
            gained = 0.0 if alone is None else alone.evidence - nothing.evidence
            shares.append(gained / (one.evidence - nothing.evidence))
    return max(shares, default=1.0)


def slight(table: Hypotheses, one: Hypothesis, cause: str = "") -> bool:
    """Whether log Z_h - log Z_plain ≤ SLIGHT (log Z_h - log Z_less): the remainder of a hypothesis
    adds so little to its causes with nominal process noise (plain) that it can be an error of their
    equations: little of what they explain beyond nothing (less), or, where that is named, of what
    one of its causes explains next to the others."""
    plain = table.found.get((one.causes, NOMINAL))
    rest = tuple(n for n in one.causes if name_of(n) != cause) if cause else ()
    less = table.found.get((rest, NOMINAL), table.nothing)
    whole = one.evidence - less.evidence
    if plain is None or whole <= 0.0:
        return False
    least = thresholds.SLIGHT * whole if table.parts.slight else 0.0
    return one.evidence - plain.evidence <= least


def explain_more(table: Hypotheses, one: Hypothesis, causes: Sequence[str]) -> bool:
    """Whether log Z_causes > log Z_remainder: these causes by themselves explain more than the
    remainder of a hypothesis does by itself. The rest may then be an error of their equations. Not
    where one of both was never weighed."""
    alone = table.found.get((tuple(causes), NOMINAL))
    remainder = table.found.get(((), one.kind))
    if not causes or alone is None or remainder is None:
        return False
    return alone.evidence > remainder.evidence


def left_by_others(table: Hypotheses, one: Hypothesis, names: Sequence[str]) -> dict[str, str]:
    """Name → why it is none, of those names that act on one unit together with another of them,
    which explains so much more that its equations may leave it:

        log Z_h - log Z_(h without it) ≤ SLIGHT (log Z_(h without it) - log Z_(h without both))
    """
    found: dict[str, str] = {}
    units = _units_of(one.causes, table.trial.record.profile)

    def without(*labels: str) -> Hypothesis | None:
        return table.found.get((tuple(n for n in one.causes if n not in labels), one.kind))

    for label in one.causes:
        rest = without(label)
        if name_of(label) not in names or rest is None:
            continue
        for other in one.causes:
            neither = without(label, other)
            if other == label or neither is None or name_of(other) not in names:
                continue
            if not units[label] & units[other]:
                continue
            explained = rest.evidence - neither.evidence
            if one.evidence - rest.evidence <= thresholds.SLIGHT * explained:
                found[name_of(label)] = (
                    f"it adds {one.evidence - rest.evidence:.0f} nats to {explained:.0f} of "
                    f"{name_of(other)} on the same unit, whose equations may leave as much"
                )
    return found


def _units_of(labels: Sequence[str], profile: Profile) -> dict[str, set[str]]:
    """Label → actuators that it ends with: "thrust_loss:port", "actuator_coupling:one/other"."""
    return {
        label: set(re.split("[+/]", label.partition(":")[2])) & set(profile.actuator_names)
        for label in labels
    }


def best_with(
    found: Posterior, names: Sequence[str], kind: str | None = None, but: Container[str] = ()
) -> Hypothesis:
    """The likeliest hypothesis that contains all of these names, each in its likeliest kind, and
    none of others; of one kind of remainder where that is given."""
    holding = [h for h in found.hypotheses if set(names) <= set(map(name_of, h.causes))]
    holding = [h for h in holding if not any(name_of(n) in but for n in h.causes)] or holding
    holding = [h for h in holding if kind in (None, h.kind)] or holding
    likeliest = [h for h in holding
                 if set(names) <= {name_of(n) for n in h.causes if found.states(n)}]  # fmt: skip
    return (likeliest or holding or found.hypotheses)[0]
