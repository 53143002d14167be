"""The verdict of a posterior, as the report and the refutation take it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from shiplog.diagnosis import posterior as posteriors
from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypothesis import Hypothesis, name_of
from shiplog.diagnosis.likelihood import ProcessNoise
from shiplog.diagnosis.posterior import FAMILY, STOCHASTIC, Posterior
from shiplog.diagnosis.result import Decision, Named, Structure
from shiplog.diagnosis.search import Search
from shiplog.diagnosis.trial import INTERMITTENT, NOMINAL
from shiplog.diagnosis.unrecorded_thruster import pulse_force

EVERYWHERE = ("surge", "sway", "yaw_rate")


def decide(
    search: Search,
    refuted: Mapping[str, str] | None = None,
    doubted: Mapping[str, str] | None = None,
) -> tuple[Decision, Posterior]:
    """The verdict, without the names that held-out data refute, and without any if the names are
    in doubt; each with its reason."""
    refuted, trial = dict(refuted or {}), search.trial
    trial.process_noise = trial.reference.process_noise  # without an earlier intermittent force
    found = posteriors.posterior(search, tuple(refuted))
    names = () if doubted else found.stated
    kind = found.remainder
    best = search.recalled(posteriors.best_with(found, names, kind if not names else None))
    mostly = posteriors.share_of_causes(search, best) >= thresholds.MOST
    mostly = mostly and not _imitated(search, best, names)
    trial.remainder = best.remainder
    verdict, structure, named, pulses = "undecided", None, (), None
    if names and mostly:
        verdict, named = "named", _named(search, found, best, names)
    elif best.kind != NOMINAL and (kind is not None or names):
        verdict, structure = "unknown", _structure(search, best)
        if best.kind == INTERMITTENT and best.pulses is not None and is_device(search, best):
            verdict, structure, pulses = "named", None, best.pulses
    elif found.none >= thresholds.STATED:
        verdict = "none"
    if verdict == "named" and best.kind == INTERMITTENT and is_device(search, best):
        pulses = best.pulses
    traces = ()
    if verdict == "none":
        rest = [n for n in map(name_of, best.causes) if n not in names]
        traces = _named(search, found, best, rest)
    shown = best if verdict in ("named", "unknown") else search.nothing
    trial.remainder = shown.remainder
    if pulses is not None:  # its force and times are taken from this trial later
        trial.process_noise = _with_pulses(search, best)
    return Decision(
        verdict, named, structure, pulses, traces,
        _reasons(search, found, refuted | dict(doubted or {}), named),
        found.ranking(), shown.found.noise_factor, search.point(shown), shown.found, search.first,
        search.nothing.found, search.told,
    ), found  # fmt: skip


def _imitated(search: Search, best: Hypothesis, names: Sequence[str]) -> bool:
    """Whether the remainder could reproduce most of a named cause's effect: with an unknown
    force of the controls, an offset of the rudder may be a part of that force."""
    shares = [
        search.trial.imitated(search.point(best), best.found, label, best.remainder)
        for label in best.causes if name_of(label) in names
    ]  # fmt: skip
    return any(share > thresholds.MOST for share in shares)


def _named(
    search: Search, found: Posterior, best: Hypothesis, names: Sequence[str]
) -> tuple[Named, ...]:
    """The causes of a hypothesis that have these names, with what else they may be."""
    by = {c.label: c for c in search.catalogue}
    columns = search.trial.reference.columns
    given, at = [], 0
    for label in best.found.numbers:
        part = slice(at, at + len(columns.of[label]))
        at = part.stop
        if label not in by or name_of(label) not in names or not found.states(label):
            continue
        others = _instead(found, best, label)
        assert best.found.covariance is not None
        given.append(
            Named(
                by[label], search.alone.get(label, float("nan")),
                found.names.get(name_of(label), 0.0), np.asarray(best.found.numbers[label]),
                best.found.covariance[part, part], tuple(others), others,
                search.trial.reference.freedom,
            )
        )  # fmt: skip
    return tuple(given)


def _instead(found: Posterior, best: Hypothesis, label: str) -> dict[str, float]:
    """Names of causes that may stand in a cause's place → nats by which they are less likely."""
    rest = set(best.causes) - {label}
    others: dict[str, float] = {}
    for one in found.hypotheses:
        more = set(one.causes) - rest
        if len(more) == 1 and rest <= set(one.causes) and one.kind == best.kind:
            other = name_of(next(iter(more)))
            behind = best.score - one.score
            if other != name_of(label) and behind < np.log(1.0 / (1.0 - thresholds.STATED)) * 2.0:
                others.setdefault(other, float(behind))
    return others


def _structure(search: Search, best: Hypothesis) -> Structure:
    gained = best.evidence - search.nothing.evidence
    family = FAMILY.get(best.kind, best.kind)
    if family in (STOCHASTIC, INTERMITTENT):
        channels = EVERYWHERE if family == STOCHASTIC else EVERYWHERE[1:]
        return Structure(family, gained, channels)
    acts_on = search.trial.acts_on(search.point(best), best.found, best.kind)
    return Structure(family, gained, acts_on)


def is_device(search: Search, best: Hypothesis) -> bool:
    assert best.pulses is not None
    trial = search.trial
    kept = trial.process_noise
    trial.process_noise = _with_pulses(search, best)
    try:
        force, deviation = pulse_force(trial, search.point(best), best.found, best.pulses)
    finally:
        trial.process_noise = kept
    return posteriors.of_one_device(force, deviation)


def _with_pulses(search: Search, best: Hypothesis) -> ProcessNoise:
    """The trial's process noise with the hypothesis' intermittent force in it."""
    assert best.pulses is not None
    return replace(search.trial.reference.process_noise, pulse=best.pulses.unit * best.pulses.force)


def _reasons(
    search: Search, found: Posterior, refuted: Mapping[str, str], named: Sequence[Named]
) -> dict[str, str]:
    """Label → why it is not named."""
    said = dict(refuted)
    kept = {n.cause.name for n in named}
    for label, gained in sorted(search.alone.items(), key=lambda pair: -pair[1])[:8]:
        name = name_of(label)
        if name in kept or name in said:
            continue
        misfit = search.placebo.get(label, 0.0)
        why = f"log Bayes factor {gained:+.0f} nats by itself"
        if misfit >= 1.0:
            why += f", of which a nominal voyage has {misfit:.0f} too"
        said[label] = f"{why}; probability {found.names.get(name, 0.0):.2f}"
    return said
