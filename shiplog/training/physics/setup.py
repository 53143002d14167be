"""One ship's equations, starting values and windows: what an identification begins with."""

from __future__ import annotations

import fnmatch
import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from shiplog.exceptions import RunError, WindowError, listed, nearest
from shiplog.models import MODELS
from shiplog.models.coefficients import Parameters
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.error_reduction import RUNAWAY
from shiplog.simulation.sensitivities import losses
from shiplog.simulation.window_series import WindowSeries, series
from shiplog.training.settings.run_config import Config
from shiplog.voyages.rows import one_hertz
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.split import plan
from shiplog.voyages.windows.windows import Windows

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Prepared:
    """One ship's equations, starting values and windows.

    data            training windows
    voyages, days   [N]  group of each of them; the same data under two names is one voyage
    free            [P]  which parameters may move
    unseen          windows of the validation voyages; None without
    """

    model: Any
    start: Parameters
    data: WindowSeries
    voyages: list[str]
    days: list[str]
    free: np.ndarray
    unseen: Windows | None

    def sentence(self, fit: bool) -> str:
        """What is identified from what; `fit` is whether any parameter moves."""
        count = int(self.free.sum()) if fit else 0
        return (
            f"{count} of {len(self.start.names)} parameters free, {len(self.voyages)} windows, "
            f"starting values from {self.start.source}"
        )


def prepare(
    config: Config,
    profile: Profile,
    learnt: pl.DataFrame,
    held: pl.DataFrame,
    planned: pl.DataFrame,
    parameters: Path | None,
    known: pl.DataFrame | None = None,
) -> Prepared:
    """Equations, starting values and windows of a run. Raises ProfileError or WindowError.

    learnt, held   seconds of the training and of the validation voyages
    planned        the training windows
    known          starting values of an earlier run: name, start, spread
    """
    equations = MODELS[config.model].equations
    model, start, estimates = equations.begin(profile, config.physics, parameters)
    if known is None:
        for sentence in estimates:
            log.info(sentence)
    else:
        start = _as_known(start, known, config.physics.parameters)
    names = (profile.actuator_names, profile.wind_names)
    cut = windows.cut(learnt, planned, config.window, *names)
    unseen = None
    if held.height:
        whole = plan(held, "ref", config.window)
        _refuse_none(whole, config.window, config.split.validation)
        unseen = windows.cut(held, whole, config.window, *names)
    twin = one_hertz.twins(learnt)
    first = dict(
        learnt.group_by("voyage").agg(pl.col("time").min().dt.strftime("%Y-%m-%d")).iter_rows()
    )
    voyages = [twin.get(name, name) for name in map(str, cut.plan["voyage"])]
    data = series(cut)
    model = _stable(model, start.values, data)
    return Prepared(
        model, start, data, voyages, [first[v] for v in voyages],
        free_parameters(config.physics.free, start), unseen,
    )  # fmt: skip


def _as_known(start: Parameters, known: pl.DataFrame, source: str) -> Parameters:
    """Raises RunError where the earlier run has other coefficients."""
    if tuple(known["name"]) != start.names:
        raise RunError(
            "The run has other coefficients than this version of its model.",
            hint="repeat it with the shiplog that made it; its provenance.json names the version.",
        )
    values, spread = (known[column].to_numpy() for column in ("start", "spread"))
    return replace(start, values=values, spread=spread, source=source)


def _refuse_none(planned: pl.DataFrame, size: int, voyages: Sequence[str]) -> None:
    if planned.height == 0:
        raise WindowError(
            f"No window of {size} s in {listed(voyages)}.", hint="choose a shorter --window."
        )


def _stable(model: Any, values: np.ndarray, data: WindowSeries) -> Any:
    """With as many Euler steps a second as a small, quick ship needs to hold every window."""
    for substeps in (1, 2, 4, 8):
        finer = replace(model, substeps=max(substeps, model.substeps))
        if (losses(finer, values, data) < RUNAWAY).all():  # not so of NaN either
            if finer.substeps > model.substeps:
                log.info("%d Euler steps within each second keep the ship stable", finer.substeps)
            return finer
    return model  # the identification says what is wrong


def free_parameters(patterns: Sequence[str], start: Parameters) -> np.ndarray:
    """Which parameters may move. Raises RunError for a pattern that none has, and where the ridge
    lets none of them move."""
    names = start.names
    if not patterns:
        return np.ones(len(names), dtype=bool)
    for pattern in patterns:
        if not fnmatch.filter(names, pattern):
            raise RunError(
                f"No parameter is called {pattern!r}{nearest(pattern, names)}.",
                hint=f"--free takes names or patterns such as 'wind.*': {listed(names, most=99)}.",
            )
    free = np.array([any(fnmatch.fnmatch(n, p) for p in patterns) for n in names])
    if not start.spread[free].any():
        chosen = [name for name, one in zip(names, free, strict=True) if one]
        raise RunError(
            f"No parameter can move: the plausible spread of {listed(chosen, most=8)} is a share "
            "of the starting value, and that is 0.",
            hint="start from another value with --parameters, or choose others with --free.",
        )
    return free
