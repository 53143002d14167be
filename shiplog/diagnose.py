"""From evidence to a verdict: what is named, what is not, and why.

Forward selection with a backward check, on one scale of evidence with `nothing but louder
unrest`, a thruster that nobody records, and unknown structures. A cause is named only where it
beats them all, is large enough to matter, and did not come out of a fit that failed.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from shiplog import unnamed
from shiplog.causes import Cause, Shown
from shiplog.hypotheses import Found, Point, Told, Trial
from shiplog.unnamed import Pulses

CONTENDS = 2.0  # nats from which on a cause is linearised again
LEAST = 8.0  # nats that the first cause must bring
MORE = 25.0  # that each further one must: small evidence follows large ones about
FLEXIBLE = 40.0  # nats that an unknown structure must bring beyond a cause: it fits anything
UNKNOWN = 60.0  # nats that it must bring where no cause is named
STOCHASTIC = 40.0  # nats that louder unrest must bring to be said
LOUD = 1.4  # times the usual unrest, from which on it is asked where it comes from
PULSED = 40.0  # nats that pulses must bring beyond louder unrest
TEMPERATURE = 3.0  # nats: a guess, until the blind cases have calibrated it
ALIKE = 8.0  # nats within which two causes cannot be told apart
MOST = 3  # causes
SETTLED = 3  # contenders that are linearised again
SHARE = 0.3  # of the best one's evidence that makes a contender
CHANGED = 2.0 / 3.0  # before any data: whoever asks has a reason to
SIZES = (0.1, 1.0)  # of realistic ones: what a change may be, each decade as likely
PULSES = "side_thrust"


@dataclass(frozen=True)
class Named:
    """One cause of the verdict. `numbers` and `covariance` are a change from what is usual."""

    cause: Cause
    evidence: float
    probability: float
    numbers: np.ndarray
    covariance: np.ndarray
    alike: tuple[str, ...] = ()

    @property
    def shown(self) -> dict[str, Shown]:
        return self.cause.told(self.numbers, self.covariance)


@dataclass(frozen=True)
class Structure:
    """What is left and has no name."""

    family: str
    evidence: float
    acts_on: tuple[str, ...]


@dataclass(frozen=True)
class Decision:
    """What the trial says, before anything was held out.

    verdict    named, none or unknown
    named      in the order they were found
    pulses     the unrecorded thruster, where it is one of the causes
    rejected   label → why not
    traces     there, but too small to matter
    ranking    label or family → probability, of the first step
    louder     λ that is left
    point, base      the trial linearised with what is named, and that hypothesis
    first, nothing   the same with nothing named
    remains    families of structure, with what they would still explain
    told       label → what these data would tell of each cause, were it there
    apart      voyage → label → numbers from the other voyages, of causes chosen on whole windows
    """

    verdict: str
    named: tuple[Named, ...]
    structure: Structure | None
    pulses: Pulses | None
    traces: tuple[Named, ...]
    rejected: Mapping[str, str]
    ranking: Mapping[str, float]
    louder: float
    point: Point
    base: Found
    first: Point
    nothing: Found
    remains: tuple[Found, ...] = field(default=())
    told: Mapping[str, Told] = field(default_factory=dict)
    apart: Mapping[str, Mapping[str, np.ndarray]] = field(default_factory=dict)

    @property
    def hidden(self) -> dict[str, float]:
        """Label → share of its plausible sizes at which these data would not show it."""
        low, high = (math.log(size) for size in SIZES)
        return {
            label: min(max((math.log(told.together(LEAST)) - low) / (high - low), 0.0), 1.0)
            for label, told in self.told.items()
        }

    @property
    def nothing_there(self) -> float:
        """Probability that nothing changed where nothing was found: of what may have, some is too
        small for these data."""
        hidden = list(self.hidden.values())
        missed = CHANGED * (sum(hidden) / len(hidden)) if hidden else CHANGED
        return (1.0 - CHANGED) / (1.0 - CHANGED + missed)


def decide(trial: Trial, point: Point, banned: Collection[str] = ()) -> Decision:
    """From a trial linearised as the model stands, with what it has of causes (`Trial.fixed`).

    banned   labels that held-out voyages have refuted already
    """
    ref = trial.reference
    fixed = trial.fixed
    known = {c.label: c for c in ref.model.causes if c.label not in fixed}
    catalogue = {label: cause for label, cause in known.items() if label not in banned}
    first_point = point
    trial.unrest = ref.unrest
    included: tuple[str, ...] = fixed
    base, found = trial.scan(point, tuple(catalogue.values()), included)
    nothing = base
    told = {f.name: f.told for f in found if f.told is not None}
    rejected: dict[str, str] = {}
    ranking: dict[str, float] = {}
    steps: dict[str, tuple[float, tuple[str, ...]]] = {}
    pulses: Pulses | None = None
    structure: Structure | None = None
    remains: list[Found] = []
    while True:
        first = len(included) == len(fixed)
        wanted = LEAST if first and pulses is None else MORE
        remains = unnamed.structures(trial, point, base, included)
        if pulses is None and base.louder >= LOUD:
            tried = unnamed.pulses(trial, point, base)
            rivals = [f.evidence for f in (*found[:1], *remains[:1])]
            if tried.gain > max(PULSED, *rivals):
                pulses = tried
                trial.unrest = replace(trial.unrest, pulse=tried.unit * tried.force)
                base, found = trial.scan(point, _left(catalogue, included), included)
                continue
        settled = _settle(trial, point, base, found, included)
        strongest = max(remains, key=lambda f: f.evidence, default=None)
        stochastic = _louder(trial, point, base, included) if base.louder > 1.0 else 0.0
        if not ranking:
            ranking = _ranked(settled, found, remains, base, wanted, stochastic)
            if pulses is not None:
                sure = odds(pulses.gain, PULSED)
                ranking = {PULSES: sure} | {k: (1.0 - sure) * v for k, v in ranking.items()}
        best = settled[0] if settled else None
        gain = best[1].evidence - base.evidence if best else -math.inf
        if strongest and strongest.evidence > max(UNKNOWN, gain + FLEXIBLE):
            structure = _structure(trial, point, strongest)
            if best:
                rejected[best[1].name.split("+")[-1]] = (
                    f"a dependence on {strongest.name} that it does not have explains "
                    f"{strongest.evidence - max(gain, 0.0):.0f} nats more"
                )
            break
        if best is None or gain < wanted or len(included) - len(fixed) >= MOST:
            break
        point, base = best
        label = next(n for n in base.numbers if n not in included)
        rivals = tuple(
            one.name.split("+")[-1]
            for _, one in settled[1:]
            if best[1].evidence - one.evidence < ALIKE
        )
        steps[label] = (gain, rivals)
        for _, one in settled[1:]:
            other = one.name.split("+")[-1]
            less = best[1].evidence - one.evidence
            rejected.setdefault(other, f"{label} explains {less:.0f} nats more")
        included = tuple(base.numbers)
        _, found = trial.scan(point, _left(catalogue, included), included)
    included, point, base, dropped = _backwards(trial, included, fixed, point, base, steps)
    for label, loss in dropped.items():
        rejected[label] = f"without it the others explain all but {loss:.0f} nats"
    named = _named(trial, included, fixed, base, steps, ranking)
    traces = tuple(n for n in named if not n.cause.practical(n.numbers, ref.setting))
    real = tuple(n for n in named if n.cause.practical(n.numbers, ref.setting))
    stochastic = _louder(trial, point, base, included) if base.louder > 1.0 else 0.0
    verdict = "named" if real or pulses else "none"
    if structure is not None and not real and pulses is None:
        verdict = "unknown"
    elif verdict == "none" and stochastic > STOCHASTIC and base.louder >= LOUD:
        verdict = "unknown"
        structure = Structure("stochastic", stochastic, ("surge", "sway", "yaw_rate"))
    return Decision(
        verdict, real, structure, pulses, traces, rejected, ranking, base.louder, point, base,
        first_point, nothing, tuple(remains), told,
    )  # fmt: skip


def without(trial: Trial, decision: Decision, one: Named) -> Decision:
    """The same verdict with one cause less, the others fitted again."""
    named = tuple(n for n in decision.named if n is not one)
    labels = tuple(n for n in decision.base.numbers if n != one.cause.label)
    if labels:
        numbers = {n: decision.base.numbers[n] for n in labels}
        point, base = trial.settle(labels, numbers, decision.point.path)
    else:
        point, base = decision.first, decision.nothing
    again, at = [], 0
    by = {n.cause.label: n for n in named}
    for label in labels:
        count = len(base.numbers[label])
        part = slice(at, at + count)
        at += count
        if label in by:
            assert base.covariance is not None
            again.append(
                replace(
                    by[label],
                    numbers=np.asarray(base.numbers[label]),
                    covariance=base.covariance[part, part],
                )
            )
    verdict = "named" if again or decision.pulses else "none"
    return replace(
        decision, named=tuple(again), verdict=verdict, point=point, base=base, louder=base.louder
    )


def untold(decision: Decision) -> Decision:
    """Of a model that simulates nothing: what is left, without a name."""
    strongest = max(decision.remains, key=lambda f: f.evidence, default=None)
    found = ("motion", 0.0) if strongest is None else (strongest.name, strongest.evidence)
    return replace(
        decision, verdict="unknown", named=(), pulses=None, traces=(),
        structure=Structure(*found, ()),
    )  # fmt: skip


def _left(catalogue: Mapping[str, Cause], included: Sequence[str]) -> list[Cause]:
    return [c for c in catalogue.values() if all(c.beside(label) for label in included)]


def _settle(trial, point, base, found, included) -> list[tuple[Point, Found]]:
    """Contenders linearised where they are found, best first; those whose fit ran away left out."""
    contenders = [
        f
        for f in found[:SETTLED]
        if f.evidence > CONTENDS and f.evidence >= SHARE * found[0].evidence
    ]
    settled = []
    for one in contenders:
        numbers = dict(base.numbers) | dict(one.numbers)
        at, fitted = trial.settle((*included, one.name), numbers, point.path)
        if np.isfinite(fitted.evidence):
            settled.append((at, fitted))
    return sorted(settled, key=lambda pair: -pair[1].evidence)


def _louder(trial: Trial, point: Point, base: Found, included: tuple[str, ...]) -> float:
    """Nats that louder unrest brings over the usual one."""
    return base.evidence - trial.level(point, 1.0, included).value


def _ranked(settled, found, remains, base, wanted, stochastic) -> dict[str, float]:
    """Probabilities of the first step, tempered; `none` holds the threshold."""
    value = {"none": wanted}
    value |= {f.name: f.evidence for f in found}
    for _, one in settled:
        value[one.name.split("+")[-1]] = one.evidence - base.evidence
    value |= {f"unknown:{f.name}": f.evidence - FLEXIBLE for f in remains}
    if base.louder >= LOUD:  # said where nothing is named
        value["unknown:stochastic"] = wanted + stochastic - STOCHASTIC
        if settled and settled[0][1].evidence - base.evidence > wanted:
            value["unknown:stochastic"] = min(value["unknown:stochastic"], wanted)
    names = list(value)
    of = np.array([value[n] for n in names]) / TEMPERATURE
    share = np.exp(of - of.max())
    share /= share.sum()
    order = np.argsort(-share)
    return {names[i]: float(share[i]) for i in order}


def odds(gain: float, wanted: float) -> float:
    """Probability of what brings so many nats where so many are wanted."""
    return 1.0 / (1.0 + math.exp(min((wanted - gain) / TEMPERATURE, 50.0)))


def _structure(trial: Trial, point: Point, found: Found) -> Structure:
    acts = unnamed.acts_on(trial, point, found)
    return Structure(found.name, found.evidence, acts)


def _backwards(trial, included, fixed, point, base, steps):
    """Each named cause must still be missed when the others are refitted without it."""
    dropped: dict[str, float] = {}
    while len(included) - len(fixed) > 1:
        losses = {}
        for label in included[len(fixed) :]:
            rest = tuple(n for n in included if n != label)
            numbers = {n: base.numbers[n] for n in rest}
            losses[label] = (base.evidence, *trial.settle(rest, numbers, point.path))
        label = min(losses, key=lambda n: losses[n][0] - losses[n][2].evidence)
        loss = losses[label][0] - losses[label][2].evidence
        if loss >= LEAST:
            break
        dropped[label] = loss
        steps.pop(label, None)
        included = tuple(n for n in included if n != label)
        point, base = losses[label][1], losses[label][2]
    return included, point, base, dropped


def _named(trial, included, fixed, base, steps, ranking) -> tuple[Named, ...]:
    by = {c.label: c for c in trial.reference.model.causes}
    found, at = [], 0
    for label in included:
        cause = by[label]
        part = slice(at, at + cause.count)
        at += cause.count
        if label in fixed:
            continue
        gain, alike = steps[label]
        first = len(found) == 0
        sure = odds(gain, MORE)
        probability = ranking.get(label, sure) if first else sure
        found.append(
            Named(
                cause, gain, probability, np.asarray(base.numbers[label]),
                base.covariance[part, part], alike,
            )
        )  # fmt: skip
    return tuple(found)
