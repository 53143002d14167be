"""What may be believed of each identified coefficient: a verdict with its reasons.

In units of the plausible spreads s, with the information H of the training windows and the
coefficients' covariance C of the run (symbols as in the room's opening):

    own     (C_ii/s_i² + D_i)^½     how sure the coefficient is by itself
    alone   (H_ii + 1)^-½           how sure it would be, were all others known

    trusted               own ≤ MEASURED, and not at a limit of its range
    only in combination   alone ≤ MEASURED < own, or parts of the data do not agree on it
    not measured          own and alone > MEASURED, at a limit, or held

MEASURED = ½: the data say at least three times what was known before any (1/own² = 4 = 3 + 1).

H and C are those of voyages that no fit has used. A model errs more on them than on those that it
was fitted to, and its coefficients are off by as much more (a variance factor, as McCullagh &
Nelder 1989 have it of counts):

    κ = max(1, L of held-out voyages/L fitted),   H' = H/κ,   C' = κ C (1 + (κ - 1) C)⁻¹

with C in units of s, so that what was known before any data is not widened. D_i is how far parts of
the data disagree on a coefficient (`agreement`): all voyages of a campaign may be alike in what the
model's form lacks, and then no variance of sampling shows it. Of 259 coefficients of 38 simulated
ships of other laws that are trusted by C' alone, 75 % lie inside their 90 % intervals; with D 123
are trusted, of which 92 % do (docs/evidence/manoeuvres.md).

Spread from voyage to voyage is the τ of a random effect (DerSimonian & Laird 1986). Voyage v alone,
with all other coefficients where they are, has the estimate and weight

    θ_v = θ̂ - q_v/H_v,   w_v = H_v,   Q = Σ_v w_v (θ_v - θ̄)²
    τ² = max(0, (Q - (V - 1))/(Σ w_v - Σ w_v²/Σ w_v))
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import polars as pl

from shiplog.exceptions import listed
from shiplog.nomenclature.numbers import NINETY_SPREADS, figure
from shiplog.training.physics.agreement import Agreement
from shiplog.training.physics.identifiability import TRADING

MEASURED = 0.5  # standard error over plausible spread, up to which the data measured it
AT_LIMIT = 1e-3  # of the plausible spread: nearer to a limit of its range it stands at the limit
MOST_ALIASES = 3  # coefficients that an alias names, the strongest first
CONTRIBUTES = 0.3  # correlation from which a coefficient is one of several that hide another
LEAST_INFORMATION = 1e-3  # H_v in units of s: of a voyage with less, no estimate of its own is used
TRUSTED, COMBINED, UNMEASURED = "trusted", "only in combination", "not measured"
VERDICTS = (TRUSTED, COMBINED, UNMEASURED)


@dataclass(frozen=True, slots=True)
class Alias:
    """`change` of another coefficient that hides a change of one standard error of this one."""

    name: str
    change: float
    correlation: float


@dataclass(frozen=True, slots=True)
class CoefficientTrust:
    """One coefficient, and what may be believed of it.

    low, high        90 % interval; None where it was held
    typical          low, high: 90 % of what was plausible before the fit, and `source` of that
    limits           low, high of its physical range
    at_limit         "low", "high" or ""
    own, alone       standard error over plausible spread: by itself; were all others known
    apart            D^½: how far parts of the data disagree on it, in its unit; None where it was
                     held
    between          τ: its standard deviation from voyage to voyage, in its unit; None where fewer
                     than two voyages show it
    voyages          how many show it
    alias            what the data cannot tell from a change of it, strongest first
    """

    name: str
    symbol: str
    meaning: str
    unit: str
    value: float
    low: float | None
    high: float | None
    typical: tuple[float, float]
    source: str
    limits: tuple[float, float]
    at_limit: str
    own: float | None
    alone: float | None
    apart: float | None
    between: float | None
    voyages: int
    alias: tuple[Alias, ...]
    verdict: str
    reason: str

    def as_json(self) -> dict:
        return asdict(self) | {"alias": [asdict(one) for one in self.alias]}


def from_json(one: Mapping[str, Any]) -> CoefficientTrust:
    """What `as_json` gave. Raises KeyError, TypeError or ValueError where it is something else."""
    if one["verdict"] not in VERDICTS:
        raise ValueError(f"there is no verdict {one['verdict']!r}")
    fields: dict[str, Any] = dict(one)
    fields |= {key: tuple(one[key]) for key in ("typical", "limits")}
    fields |= {"alias": tuple(Alias(**each) for each in one["alias"])}
    return CoefficientTrust(**fields)


@dataclass(frozen=True)
class Information:
    """Of the training windows, by voyage, at θ̂: per σ², before units.

    gram   voyage → Σ_w Σ_t J_wᵀ W² J_w Δt/σ² [P, P]
    pull   voyage → Σ_w Σ_t J_wᵀ W² r_t Δt/σ² [P]
    """

    gram: Mapping[str, np.ndarray]
    pull: Mapping[str, np.ndarray]

    @property
    def whole(self) -> np.ndarray:
        """H [P, P] of all voyages."""
        return np.sum(list(self.gram.values()), axis=0)


def on_new_voyages(covariance: np.ndarray, spread: np.ndarray, kappa: float) -> np.ndarray:
    """C' = κ C (1 + (κ - 1) C)⁻¹ of a covariance [P, P] in SI; C in units of the spreads [P]."""
    scale = np.where(spread > 0.0, spread, 1.0)
    C = covariance / np.outer(scale, scale)
    wide = kappa * np.linalg.solve(np.eye(len(C)) + (kappa - 1.0) * C, C)
    return 0.5 * (wide + wide.T) * np.outer(scale, scale)


def judge(
    identified: pl.DataFrame,
    covariance: np.ndarray,
    limits: tuple[np.ndarray, np.ndarray],
    found: Information,
    source: str,
    agreed: Agreement | None = None,
) -> tuple[CoefficientTrust, ...]:
    """The verdict on every coefficient.

    identified   name, symbol, meaning, unit, start, spread, value, standard_error, free [P]
    covariance   C [P, P], zero where a coefficient was held
    limits       low, high [P] of their physical ranges
    source       where the plausible values are from
    agreed       how far parts of the data disagree; None where there are no parts
    """
    rows = identified.to_dicts()
    spread = identified["spread"].to_numpy()
    free = identified["free"].to_numpy() & (spread > 0.0)
    scale = np.where(free, spread, 1.0)
    H = np.diag(found.whole) * scale**2
    sampled = np.sqrt(np.diag(covariance))
    agreed = agreed or Agreement(np.zeros(len(rows)), ("",) * len(rows))
    error = np.hypot(sampled, scale * agreed.apart)
    deviation = np.where(sampled > 0.0, sampled, 1.0)
    correlation = covariance / np.outer(deviation, deviation)
    judged = []
    for i, row in enumerate(rows):
        between, voyages = _between_voyages(found, i, scale[i]) if free[i] else (None, 0)
        low, high = (float(side[i]) for side in limits)
        at = _at_limit(row["value"], low, high, AT_LIMIT * spread[i]) if free[i] else ""
        own, alone = error[i] / scale[i], float((H[i] + 1.0) ** -0.5)
        agreeing = sampled[i] / scale[i]  # its error, if all parts agreed on it
        hidden = agreeing > MEASURED >= alone  # then whatever hides it is named, weak as it may be
        beyond = CONTRIBUTES if hidden else TRADING
        alias = _alias(i, rows, error, sampled, correlation, beyond) if free[i] else ()
        apart = ""
        if own > MEASURED >= agreeing:
            apart = (
                f"{agreed.worst[i]} do not agree on it: its error is {figure(own)} of the "
                f"plausible spread, and {figure(agreeing)} if they did"
            )
        verdict, reason = _verdict(free[i], at, own, alone, between, scale[i], alias, apart)
        judged.append(
            CoefficientTrust(
                row["name"], row["symbol"], row["meaning"], row["unit"], row["value"],
                *_interval(row["value"], error[i] if free[i] else None),
                _typical(row["start"], spread[i], low, high), source, (low, high), at,
                float(own) if free[i] else None, alone if free[i] else None,
                float(scale[i] * agreed.apart[i]) if free[i] else None,
                between, voyages, alias, verdict, reason,
            )
        )  # fmt: skip
    return tuple(judged)


def _interval(value: float, error: float | None) -> tuple[float | None, float | None]:
    if error is None:
        return None, None
    return value - NINETY_SPREADS * error, value + NINETY_SPREADS * error


def _typical(start: float, spread: float, low: float, high: float) -> tuple[float, float]:
    """θ₀ ± 1.645 s, within the physical range."""
    wide = NINETY_SPREADS * spread
    return max(start - wide, low), min(start + wide, high)


def _at_limit(value: float, low: float, high: float, room: float) -> str:
    return "low" if value < low + room else "high" if value > high - room else ""


def _between_voyages(found: Information, i: int, scale: float) -> tuple[float | None, int]:
    """τ in the coefficient's unit, and how many voyages show it."""
    weights = np.array([gram[i, i] for gram in found.gram.values()]) * scale**2
    pulls = np.array([pull[i] for pull in found.pull.values()]) * scale
    shown = weights > LEAST_INFORMATION
    w, own = weights[shown], -pulls[shown] / np.where(shown, weights, 1.0)[shown]
    if len(w) < 2:
        return None, len(w)
    Q = float(w @ (own - w @ own / w.sum()) ** 2)
    squared = max(Q - (len(w) - 1), 0.0) / float(w.sum() - w @ w / w.sum())
    return float(np.sqrt(squared)) * scale, len(w)


def _alias(
    i: int, rows: Sequence[Mapping], error: np.ndarray, sampled: np.ndarray,
    correlation: np.ndarray, beyond: float,
) -> tuple[Alias, ...]:  # fmt: skip
    """δθ_j = ρ_ij C_jj^½ e_i/C_ii^½: how the others move where this one moves by its standard error
    e_i, of those that are correlated with it beyond `beyond`."""
    others = [j for j in np.argsort(-np.abs(correlation[i])) if j != i]
    strong = [int(j) for j in others if abs(correlation[i, j]) > beyond][:MOST_ALIASES]
    moved = error[i] / sampled[i] if sampled[i] > 0.0 else 0.0
    return tuple(
        Alias(
            rows[j]["name"], float(correlation[i, j] * sampled[j] * moved), float(correlation[i, j])
        )
        for j in strong
    )


def _verdict(
    free: bool, at: str, own: float, alone: float, between: float | None, scale: float,
    alias: Sequence[Alias], apart: str,
) -> tuple[str, str]:  # fmt: skip
    if not free:
        return UNMEASURED, "held: the fit did not move it"
    if at:
        return UNMEASURED, f"at the {at}er limit of its physical range".replace("higher", "upper")
    if min(own, alone) > MEASURED:
        return UNMEASURED, (
            f"these voyages hardly show it: even with all others known, its error would be "
            f"{figure(alone)} of the plausible spread"
        )
    if apart:
        return COMBINED, apart
    if own > MEASURED:
        others = f" with {listed(one.name for one in alias)}" if alias else " with several others"
        return COMBINED, (
            f"shown only together{others}: by itself its error is {figure(own)} of the plausible "
            f"spread, and {figure(alone)} were the others known"
        )
    if between is not None and between > MEASURED * scale:
        return COMBINED, (
            f"voyages do not agree on it: it varies by {figure(between)} from one to another"
        )
    return TRUSTED, f"its error is {figure(own)} of the plausible spread"


def alias_sentence(one: CoefficientTrust, error: float) -> str:
    """`k₀ up by 0.04 with k₁ down by 0.07 looks the same to these data`; empty without an alias."""
    if not one.alias:
        return ""
    also = listed(
        f"{a.name} {'up' if a.change > 0 else 'down'} by {figure(abs(a.change))}" for a in one.alias
    )
    return f"{one.name} up by {figure(error)} with {also} looks the same to these data"
