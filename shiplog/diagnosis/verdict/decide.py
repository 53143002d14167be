"""The verdict of a posterior, as the report and the refutation take it.

Of P from `posterior`, names are stated where P(cause) ≥ STATED, and so is a kind of remainder. With
h the likeliest hypothesis with these names, the first of these lines that holds is the verdict:

    named      causes of h with stated names, of which the remainder could do no more than MOST, and
               which explain MOST of what h does, unless its remainder is a device
    unknown    the remainder of h is not nominal, and a kind or a name is stated; undecided where
               causes explain more than it, it is a device with 0 < P < STATED, or held-out voyages
               have refuted a cause
    none       no change is probable enough, as `posterior` states it
    undecided  else

A remainder that is a device with P ≥ STATED is named, too: the unrecorded thruster.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import fits
from shiplog.diagnosis.hypotheses.hypothesis import Hypothesis, form_error_of, name_of
from shiplog.diagnosis.hypotheses.search import Search
from shiplog.diagnosis.hypotheses.table import Hypotheses
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, Remainder
from shiplog.diagnosis.trial.fitted import Fit
from shiplog.diagnosis.verdict import posterior as posteriors
from shiplog.diagnosis.verdict.posterior import FAMILY, STOCHASTIC, Posterior
from shiplog.diagnosis.verdict.result import (
    EXPLAIN_MORE,
    PATTERN,
    REFUTED,
    Decision,
    Named,
    Structure,
)

# A cause that is at most 100 times less probable than a named one may stand in its place.
INSTEAD_NATS = -2.0 * math.log(1.0 - thresholds.STATED)
MOST_REASONS = 8  # of the likeliest causes by themselves that are not named
EVERYWHERE = ("surge", "sway", "yaw_rate")


def decide(
    search: Search,
    refuted: Mapping[str, str] | None = None,
    doubted: Mapping[str, str] | None = None,
) -> tuple[Decision, Posterior]:
    """The verdict of the hypotheses that are not banned.

    refuted   name → why held-out voyages refute it; its hypotheses are banned already
    doubted   name → why it is not named, whatever its probability; with any, nothing is named
    """
    refuted, table = dict(refuted or {}), search.table
    found = posteriors.posterior(search)
    names = () if doubted else found.stated
    stated_kind = found.remainder
    best = posteriors.best_with(found, names, stated_kind if not names else None)
    left = posteriors.left_by_others(table, best, names)
    names = tuple(name for name in names if name not in left)
    if left:
        best = posteriors.best_with(found, names, best.kind, left)
    fit = table.fit(best)
    p_device = posteriors.device(table, best)
    kind = posteriors.practical_kind(table, best)
    is_device = p_device >= thresholds.STATED  # then what remains has a name, too
    in_doubt = _imitated(table, best, fit, names)
    sure = tuple(name for name in names if name not in in_doubt)
    kept = [n for n in best.causes if name_of(n) not in in_doubt]
    explain_most = is_device or posteriors.share_of_causes(table, best, kept) >= _most(table)
    verdict, structure, named, side_force = "undecided", None, (), None
    either: tuple[str, ...] = ()
    why = ""
    if sure and explain_most:
        verdict, named = "named", _named(table, found, best, sure)
    elif kind != NOMINAL and (stated_kind is not None or names):
        structure = _structure(table, best, fit)
        probable = tuple(n for n in best.causes if name_of(n) in found.stated)
        if p_device == 0.0 and posteriors.explain_more(table, best, probable):
            either, why = tuple(dict.fromkeys(map(name_of, probable))), EXPLAIN_MORE
        elif 0.0 < p_device < thresholds.STATED:
            why = PATTERN
        elif refuted and not is_device:
            either, why = tuple(refuted), REFUTED
        else:
            verdict = "unknown"
    elif found.states_none:
        verdict = "none"
    if verdict in ("named", "unknown") and is_device:
        verdict, structure, side_force = "named", None, best.side_force
    traces = ()
    if verdict == "none":
        rest = [n for n in map(name_of, best.causes) if n not in names]
        traces = _named(table, found, best, rest)
    stands = verdict in ("named", "unknown") or (verdict == "none" and not best.causes)
    reported = fit if stands else table.fit(table.nothing)
    if side_force is not None:
        reported = _add_side_force(reported, side_force)
    return Decision(
        verdict=verdict, named=named, structure=structure, side_force=side_force, traces=traces,
        rejected=_reasons(
            search, found, refuted | dict(doubted or {}) | in_doubt | left, named
        ),
        ranking=found.ranking(either, why, p_device),
        fit=reported, nothing=Fit(table.first, table.nothing.estimate, reported.remainder),
        expected=search.expected, one_of=_additional_causes(table, found, best, named),
        either=either, why=why,
    ), found  # fmt: skip


def _most(table: Hypotheses) -> float:
    """Share of what a hypothesis explains, that its causes have to explain."""
    return thresholds.MOST if table.parts.share_of_causes else 0.0


def _imitated(
    table: Hypotheses, best: Hypothesis, fit: Fit, names: Sequence[str]
) -> dict[str, str]:
    """Names → why each is in doubt: the remainder could do more than MOST of what the cause does,
    max over labels of `fits.imitated`. An offset
    of the rudder, for instance, may be a part of an unknown force of the controls. That puts no
    other cause in doubt, nor does a remainder that is slight next to what the cause explains."""
    shares: dict[str, float] = {}
    for label in fit.included:
        name = name_of(label)
        if label in table.trial.fixed or name not in names:
            continue
        if table.parts.imitation and not posteriors.slight(table, best, name):
            size = _needed_size(table, fit.remainder, name)
            share = fits.imitated(table.trial, fit, label, size)
            shares[name] = max(share, shares.get(name, 0.0))
    return {
        name: f"what remains unknown could do {share:.0%} of it as well"
        for name, share in shares.items()
        if share > thresholds.MOST
    }


def _needed_size(table: Hypotheses, remainder: Remainder, name: str) -> float:
    """How large a remainder of this kind would be if it had to do the work of a cause: in the most
    probable hypothesis without it. With the cause, it is only what the cause leaves."""
    others = (h.remainder.size for h in table.ranked(name) if h.kind == remainder.kind)
    return max(remainder.size, next(others, 0.0))


def _named(
    table: Hypotheses, found: Posterior, best: Hypothesis, names: Sequence[str]
) -> tuple[Named, ...]:
    """The causes of a hypothesis that have these names, with what else they may be. Of numbers x
    the covariance is V + diag((f x)²) + (u x)(u x)ᵀ: f the error of a cause's equations, u one
    error that all its numbers share."""
    by, columns = table.by, table.trial.reference.columns
    given, at = [], 0
    for label in best.estimate.numbers:
        part = slice(at, at + len(columns.indices[label]))
        at = part.stop
        if label not in by or name_of(label) not in names or not found.states(label):
            continue
        assert best.estimate.covariance is not None
        numbers = np.asarray(best.estimate.numbers[label])
        share = form_error_of(by[label]) if table.parts.form_error else 0.0
        fx = share * numbers  # its equations are no better than that
        ux = by[label].unit_error * numbers  # one error of all numbers of the cause
        given.append(
            Named(
                by[label], table.alone.get(label, float("nan")),
                found.names.get(name_of(label), 0.0), numbers,
                best.estimate.covariance[part, part] + np.diag(fx**2) + np.outer(ux, ux),
                _substitutes(found, best, label), table.trial.reference.freedom,
            )
        )  # fmt: skip
    return tuple(given)


def _additional_causes(
    table: Hypotheses, found: Posterior, best: Hypothesis, named: Sequence[Named]
) -> tuple[str, ...]:
    """Names of which one acts in addition to those that are named. A remainder that is not slight
    could do their work, too."""
    nominal = posteriors.practical_kind(table, best) == NOMINAL
    clear = nominal or posteriors.slight(table, best)
    return found.one_of if named and clear else ()


def _substitutes(found: Posterior, best: Hypothesis, label: str) -> tuple[str, ...]:
    """Labels of causes of another name that may stand in a cause's place: of hypotheses with that
    one instead and score_best - score < INSTEAD_NATS."""
    rest = set(best.causes) - {label}
    others: dict[str, None] = {}
    for one in found.hypotheses:
        more = set(one.causes) - rest
        near = best.score - one.score < INSTEAD_NATS and one.kind == best.kind
        if near and len(more) == 1 and rest <= set(one.causes):
            (other,) = more
            if name_of(other) != name_of(label):
                others.setdefault(other)
    return tuple(others)


def _structure(table: Hypotheses, best: Hypothesis, fit: Fit) -> Structure:
    """The family of what remains, log Z_best - log Z_nothing, and the channels that it acts on."""
    gained = best.evidence - table.nothing.evidence
    family = FAMILY.get(best.kind, best.kind)
    if family in (STOCHASTIC, INTERMITTENT):
        channels = EVERYWHERE if family == STOCHASTIC else EVERYWHERE[1:]
        return Structure(family, gained, channels)
    return Structure(family, gained, fits.acts_on(table.trial, fit, best.kind))


def _add_side_force(fit: Fit, side_force: SideForce) -> Fit:
    """The same with the intermittent force in its remainder."""
    return replace(fit, remainder=side_force.remainder)


def _reasons(
    search: Search, found: Posterior, refuted: Mapping[str, str], named: Sequence[Named]
) -> dict[str, str]:
    """Label → why it is not named."""
    table, kept = search.table, {n.cause.name for n in named}
    reasons = {name: why for name, why in refuted.items() if name not in kept}
    for label, gained in sorted(table.alone.items(), key=lambda pair: -pair[1])[:MOST_REASONS]:
        name = name_of(label)
        if name in kept or name in reasons or table.by[label].special:
            continue
        misfit = table.placebo.get(label, 0.0)
        why = f"log Bayes factor {gained:+.0f} nats by itself"
        if misfit >= 1.0:
            why += f", of which a nominal voyage has {misfit:.0f} too"
        if label in search.diverged:
            why += ", and no fit: it diverges from there"
        reasons[label] = f"{why}; probability {found.names.get(name, 0.0):.2f}"
    return reasons
