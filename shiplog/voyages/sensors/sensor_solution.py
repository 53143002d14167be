"""The fit of two sensors, with its delays: tried from several, and asked whether they are any."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol, Self, TypeVar

import numpy as np

from shiplog.voyages.sensors.robust_regression import Problem, RobustFit, fit, rough, spread_over
from shiplog.voyages.sensors.sensor_findings import (
    AT_LIMIT,
    DELAY_SHARE,
    MARGINS_S,
    MOST_SCALE,
    SURE_HALF_INTERVALS,
)

ROUGH_ROWS = 6_000
NOTABLE_S = 0.05  # a smaller delay is none that anyone would correct
WORSE = 1.05  # times the difference without a delay: more, and there is no delay


class Begun(Protocol):
    """Rows of which the first can be taken alone."""

    def beginning(self, rows: int) -> Self: ...


M = TypeVar("M", bound=Begun)


def solved(
    motion: M,
    problem: Callable[[M, float], Problem],
    clocks: tuple[int, ...],
    scale: int,
    slow: tuple[int, ...],
) -> RobustFit | str:
    """Fit with delays up to the small margin, and again with the large one if that binds.

    It starts from what the first ten minutes say, tried from several delays. What ends at a limit
    was not found, nor a delay that does not show over `slow` [s]: the answer is then why.

    problem   motion and largest delay [s] → what is to vanish
    clocks    indices of the delays; scale: that of the ratio of the two sides
    """
    beginning = motion.beginning(ROUGH_ROWS)
    late = 0.0
    for margin in MARGINS_S:
        coarse = problem(beginning, margin)
        starts = [np.zeros(len(coarse.prior))]
        for clock in set(clocks) & set(coarse.free):
            for delay in (-0.5 * margin, 0.5 * margin):
                starts.append(np.where(np.arange(len(coarse.prior)) == clock, delay, 0.0))
        whole = problem(motion, margin)
        try:
            found = fit(whole, rough(coarse, starts))
        except np.linalg.LinAlgError:  # a ship at rest, or a log that never turns
            found = None
        if found is None:
            return "the manoeuvres are too few, or show one error only together with another"
        if abs(found.value[scale]) > AT_LIMIT * MOST_SCALE:
            return (
                f"the search ends at its limit: they differ by more than {100 * MOST_SCALE:.0f} %"
            )
        late = float(np.max(np.abs(found.value[list(clocks)])))
        if late < DELAY_SHARE * margin:
            if _in_the_way(whole, found, clocks, slow):
                return found
            return "a delay would explain what changes in a second, and not what does in a minute"
    return f"the search ends at its limit: a delay of more than {DELAY_SHARE * margin:.1f} s"


def _in_the_way(
    problem: Problem, found: RobustFit, clocks: tuple[int, ...], slow: tuple[int, ...]
) -> bool:
    """Whether what the two sides differ by over `slow` [s] is no more with the delays than without.

    A fit of changes from second to second looks at the noise as much as at the manoeuvre. A delay τ
    of a velocity moves the way by τ ΔV as well, over any time: without it the others are fitted
    anew, and the way must not agree better.
    """
    ends = [found.interval(clock) for clock in clocks]
    if not any(abs(v) > max(NOTABLE_S, SURE_HALF_INTERVALS * 0.5 * (b - a)) for v, a, b in ends):
        return True
    prior = problem.prior.copy()
    prior[list(clocks)] = 0.0
    start = np.where(prior > 0.0, found.value, 0.0)
    try:
        without = fit(replace(problem, prior=prior), start)
    except np.linalg.LinAlgError:  # nothing to compare the delay with
        without = None
    if without is None:
        return True
    late, punctual = problem.model(found.value), problem.model(without.value)
    return all(
        spread_over(late, problem.grid, s) <= WORSE * spread_over(punctual, problem.grid, s)
        for s in slow
    )
