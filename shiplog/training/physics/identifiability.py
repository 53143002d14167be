"""Parameters that the data could not separate, as sentences of the report.

Of the estimate's covariance C and the plausible spreads s: a parameter is undetermined where
C_ii^½ > SILENT s_i, and two are not separated where |C_ij|/(C_ii C_jj)^½ > TRADING.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np

from shiplog.training.physics.output_error import Identified

SILENT = 0.9  # standard error over plausible spread above which the data do not determine it
TRADING = 0.75  # correlation of two estimates above which they are not separated
MOST_PAIRS = 6
MANY = 3  # coefficients at their limits, from which something is wrong: a sound fit has one or none
SEVERAL = 2  # of one part of the model, from which that part is asked about
SIGN = "is a `sign` turned round, or did no log go that way?"
QUESTIONS = {  # part of the model → what else may be wrong
    "hull": "is a unit of the velocity, the length or the mass wrong?",
    "propeller": "is its `sign`, `unit` or diameter_m wrong?",
    "rudder": "is its `sign` or `unit` wrong, or are two exchanged?",
    "thruster": "is a `sign`, `unit` or position_m wrong?",
    "wind": "is its angle mirrored, counted from north, or where it blows to; or its unit wrong?",
}


def undetermined(found: Identified, spread: np.ndarray) -> np.ndarray:
    """C_ii^½ > SILENT s_i [P]: mask of free parameters that stand where the ridge holds them."""
    return found.free & (found.standard_error > SILENT * spread)


def correlations(found: Identified) -> np.ndarray:
    """C_ij/(C_ii C_jj)^½ [P, P], zero where a parameter was held."""
    error = found.standard_error
    scale = np.where(error > 0, error, 1.0)
    return found.covariance / np.outer(scale, scale) * (np.outer(error, error) > 0)


def correlated_pairs(found: Identified) -> list[tuple[int, int, float]]:
    """Pairs i < j with |correlation| > TRADING, strongest first: parameters that only show
    together."""
    matrix = np.triu(correlations(found), 1)
    rows, columns = np.nonzero(np.abs(matrix) > TRADING)
    pairs = [(int(i), int(j), float(matrix[i, j])) for i, j in zip(rows, columns, strict=True)]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))


def describe(
    found: Identified,
    names: Sequence[str],
    spread: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    meaning: Callable[[str], str],
) -> list[str]:
    """Sentences for a report: correlated, undetermined and limited parameters."""
    return [*separated(found, names, spread, meaning), *doubts(found, names, spread, bounds)]


def separated(
    found: Identified, names: Sequence[str], spread: np.ndarray, meaning: Callable[[str], str]
) -> list[str]:
    """Sentences on correlated and on undetermined parameters."""
    sentences = []
    for i, j, value in correlated_pairs(found)[:MOST_PAIRS]:
        sentences.append(
            f"{meaning(names[i])} ({names[i]}) and {meaning(names[j])} ({names[j]}) trade against "
            f"each other here: correlation {value:+.2f}."
        )
    more = len(correlated_pairs(found)) - MOST_PAIRS
    if more > 0:
        sentences.append(f"{more} more pairs correlate above {TRADING}.")
    quiet = [names[int(i)] for i in np.flatnonzero(undetermined(found, spread))]
    if quiet:
        sentences.append(
            f"These data say nothing about {', '.join(quiet)}: they stand where they started."
        )
    return sentences


def doubts(
    found: Identified,
    names: Sequence[str],
    spread: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
) -> list[str]:
    """Sentences on what may be wrong: parameters at their limits, a fit that did not converge."""
    low, high = bounds
    room = 1e-3 * spread
    stuck = found.free & ((found.values < low + room) | (found.values > high - room))
    limited = {names[int(i)]: float(found.values[i]) for i in np.flatnonzero(stuck)}
    vanished = {names[int(i)] for i in np.flatnonzero(stuck & (found.values < low + room))}
    sentences = at_limits(limited, vanished, names)
    if not found.converged:
        sentences.append(f"The identification did not converge: {found.message}.")
    return sentences


def at_limits(
    limited: Mapping[str, float], vanished: Collection[str], names: Sequence[str]
) -> list[str]:
    """Sentences on coefficients at the limits of their physical ranges: few of them are ordinary,
    many in one part of the model are a wrong sign or unit of what it acts on.

    limited    name → value
    vanished   those of them that are at their lower limit
    names      of all coefficients
    """
    if not limited:
        return []
    each = ", ".join(f"{name} at {value:g}" for name, value in limited.items())
    if len(limited) == 1:
        ((name, value),) = limited.items()
        said = [
            f"{name} ran into the limit of its physical range at {value:g}: these data hardly "
            "determine it, or the model lacks something there."
        ]
    else:
        end = (
            "something else in the model is missing, or a sensor is wrong"
            if len(limited) >= MANY
            else "these data hardly determine them, or the model lacks something there"
        )
        said = [
            f"{len(limited)} of {len(names)} coefficients ran into the limits of their physical "
            f"ranges ({each}): {end}."
        ]
    gone = [way for way in ("ahead", "astern") if _all_gone(way, vanished, names)]
    said += [f"All thrust {way} vanished: {SIGN}" for way in gone]
    for part, question in QUESTIONS.items():
        own = [name for name in limited if name.startswith(f"{part}.")]
        if len(own) >= SEVERAL and not (part == "thruster" and gone):
            said.append(f"{len(own)} of them are of the {part}: {question}")
    return said


def _all_gone(way: str, vanished: Collection[str], names: Sequence[str]) -> bool:
    """Whether no thruster of the model has any thrust that way."""
    every = [n for n in names if n.startswith("thruster.") and n.endswith(f"_{way}")]
    return bool(every) and set(every) <= set(vanished)
