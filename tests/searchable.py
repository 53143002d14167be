"""Trials in which something is hidden, and searches of them."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import straight
from straight import CAUSES

from shiplog.diagnosis.hypotheses import as_it_stands
from shiplog.diagnosis.hypotheses.intermittent import ResidualNoise
from shiplog.diagnosis.hypotheses.search import Search
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.trial.fitted import Fit

SENSITIVITY = 0.6
NOMINAL_SEED, TRIAL_SEED = 1, 2


def numbers_of(columns, hidden) -> np.ndarray:
    whole = np.zeros(columns.linearised)
    for label, values in hidden.items():
        whole[columns.indices[label]] = values
    return whole


def trial_with(hidden, causes=CAUSES, fixed=None, alike=None, **changes):
    """A trial with these numbers (SI), and its first point.

    alike   two labels whose columns are the same, but for a share of the second one's own
    """
    columns = straight.columns_of(causes)
    nominal, record = straight.sailed(12), straight.sailed(8, seed=3)
    campaign = straight.campaign(
        nominal,
        straight.passed(nominal, columns, seed=NOMINAL_SEED, sensitivity=SENSITIVITY),
        columns,
    )
    given = straight.passed(record, columns, seed=TRIAL_SEED, sensitivity=SENSITIVITY, **changes)
    if alike is not None:
        one, other, share = alike
        j = given.j.copy()
        j[..., columns.indices[other]] *= share
        j[..., columns.indices[other]] += j[..., columns.indices[one]]
        given = replace(given, j=j)
    given = replace(given, e=given.e + given.j @ numbers_of(columns, hidden))
    trial = straight.trial(campaign, record, given, tuple(fixed or {}))
    return as_it_stands.begin(trial, {n: np.asarray(v) for n, v in (fixed or {}).items()})


@dataclass(frozen=True)
class Noise(ResidualNoise):
    """Estimates of raised noise, and a force as given: its estimate at a fit, and its pattern."""

    at_one_place: bool = False
    estimate: Callable[[Fit], SideForce] = straight.no_hull
    pattern: Callable[[SideForce], SideForce] = lambda force: force

    def side_force(self, fit):
        return self.estimate(fit)

    def add_pattern(self, fit, force):
        return self.pattern(force)


def search_of(trial, point, placebo=None, likely=None, **force) -> Search:
    """A search whose noise is as `Noise` has it."""
    return Search(trial, point, placebo or {}, likely, Noise(trial, **force))


def searched(hidden, placebo=None, likely=None, **setting) -> Search:
    trial, point = trial_with(hidden, **setting)
    found = search_of(trial, point, placebo, likely)
    found.run()
    return found


def raised_noise() -> np.ndarray:
    """[S, 3J] three times the nominal process noise."""
    plain, _ = trial_with({})
    kernel = np.linalg.cholesky(straight.PROCESS_NOISE.kernel(plain.grid.nodes))
    return 3.0 * np.random.default_rng(6).standard_normal((8, len(kernel))) @ kernel.T
