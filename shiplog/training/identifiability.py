"""Parameters that the data could not separate, as sentences of the report."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from shiplog.training.output_error import Identified

SILENT = 0.9  # standard error over plausible spread above which the data do not determine it
TRADING = 0.75  # correlation of two estimates above which they are not separated
MOST_PAIRS = 6


def silent(found: Identified, spread: np.ndarray) -> np.ndarray:
    """Mask [P] of free parameters that stand where the ridge holds them."""
    return found.free & (found.standard_error > SILENT * spread)


def correlations(found: Identified) -> np.ndarray:
    """[P, P], zero where a parameter was held."""
    error = found.standard_error
    scale = np.where(error > 0, error, 1.0)
    return found.covariance / np.outer(scale, scale) * (np.outer(error, error) > 0)


def trades(found: Identified) -> list[tuple[int, int, float]]:
    """Pairs of parameters that only show together, strongest first."""
    matrix = np.triu(correlations(found), 1)
    rows, columns = np.nonzero(np.abs(matrix) > TRADING)
    pairs = [(int(i), int(j), float(matrix[i, j])) for i, j in zip(rows, columns, strict=True)]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))


def note(
    found: Identified,
    names: Sequence[str],
    spread: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    meaning: Callable[[str], str],
) -> list[str]:
    """Sentences for a report: correlated, undetermined and limited parameters."""
    sentences = []
    for i, j, value in trades(found)[:MOST_PAIRS]:
        sentences.append(
            f"{meaning(names[i])} ({names[i]}) and {meaning(names[j])} ({names[j]}) trade against "
            f"each other here: correlation {value:+.2f}."
        )
    more = len(trades(found)) - MOST_PAIRS
    if more > 0:
        sentences.append(f"{more} more pairs correlate above {TRADING}.")
    quiet = [names[int(i)] for i in np.flatnonzero(silent(found, spread))]
    if quiet:
        sentences.append(
            f"These data say nothing about {', '.join(quiet)}: they stand where they started."
        )
    low, high = bounds
    room = 1e-3 * spread
    stuck = found.free & ((found.values < low + room) | (found.values > high - room))
    for i in np.flatnonzero(stuck):
        sentences.append(
            f"{names[int(i)]} ran into the limit of its physical range at {found.values[i]:g}: "
            "something else in the model is missing, or a sensor is wrong."
        )
    if not found.converged:
        sentences.append(f"The identification did not converge: {found.message}.")
    return sentences
