"""The trust in a run's coefficients, judged once and kept in its folder as trust.json."""

from __future__ import annotations

import logging

import numpy as np

from shiplog.machine import files
from shiplog.nomenclature.contract import CONTRACT
from shiplog.simulation.sensitivities import normal
from shiplog.simulation.window_series import Normal, WindowSeries, series
from shiplog.training.physics import agreement, trust
from shiplog.training.physics.output_error import residual_variance
from shiplog.training.physics.trust import CoefficientTrust, Information
from shiplog.training.runs.load_model import PhysicalRun, Run
from shiplog.training.settings import run_files
from shiplog.voyages.windows import windows

log = logging.getLogger(__name__)

FILE = "trust.json"
SHEET = "trial_sheet.toml"  # of a run from a trial sheet, which has no voyage to judge by


def of_run(run: Run) -> tuple[CoefficientTrust, ...]:
    """What may be believed of the run's coefficients, as they were identified from its training
    voyages. An empty tuple of a network, of a run that was fitted to nothing, and of an extended
    one: its coefficients were fitted again together with its causes, and no interval was kept.

    A run that was made before there was a trust.json, or before there was `apart` in it, gets a
    new one, if its folder can be written.
    """
    if run.given or run.extension is not None or not isinstance(run, PhysicalRun):
        return ()
    path = run.path / FILE
    kept = _read(run) if path.is_file() else None
    if kept is not None:
        return kept
    if (run.path / SHEET).is_file():
        return ()
    judged = judge(run)
    try:
        save(run, judged)
    except OSError as error:  # a colleague's folder; what was judged is good all the same
        log.info("%s is not kept: %s.", path, error.strerror)
    return judged


def judge(run: PhysicalRun) -> tuple[CoefficientTrust, ...]:
    """By the run's training windows, at its coefficients."""
    seed = run.config.seeds[0]
    identified, simulator = run.identified(seed), run.simulator(seed)
    names = (run.profile.actuator_names, run.profile.wind_names)
    cut = windows.cut(run.training(), run.windows(), run.config.window, *names)
    data, count = series(cut), identified.height
    every = normal(simulator.model, simulator.theta, data, tuple(range(count)))
    kappa = _factor(run, every.loss)
    fitted = residual_variance(every.loss, data)
    voyages = cut.plan["voyage"].to_list()

    def of(part: WindowSeries) -> Normal:
        return normal(simulator.model, simulator.theta, part, tuple(range(count)))

    parts = agreement.groups(data, agreement.partitions(data, voyages), of)
    each = parts.get(agreement.VOYAGES) or [agreement.Group(every.gram, every.pull.sum(0))]
    names_of = dict.fromkeys(voyages)
    variance = kappa * fitted
    grams = {name: one.gram / variance for name, one in zip(names_of, each, strict=True)}
    pulls = {name: one.pull / variance for name, one in zip(names_of, each, strict=True)}
    nominal = run.nominal()
    spread, free = identified["spread"].to_numpy(), identified["free"].to_numpy()
    free = free & (spread > 0.0)
    agreed = agreement.agreement(parts, fitted, np.where(free, spread, 1.0), free)
    covariance = trust.on_new_voyages(simulator.covariance[:count, :count], spread, kappa)
    return trust.judge(
        identified, covariance, (nominal.low, nominal.high), Information(grams, pulls),
        run.config.physics.parameters or nominal.source, agreed,
    )  # fmt: skip


def _factor(run: PhysicalRun, fitted: np.ndarray) -> float:
    """κ of L of the training windows [N]; 1 of a run that held no voyage out."""
    table = run.cross_validation()
    if table is None:
        return 1.0
    held = table.filter(held_out="voyages").sort("window")["loss"].to_numpy()
    if len(held) != len(fitted):
        return 1.0
    ends = np.isfinite(held) & np.isfinite(fitted)
    mean = float(fitted[ends].mean()) if ends.any() else 0.0
    return max(1.0, float(held[ends].mean()) / mean) if mean > 0.0 else 1.0


def save(run: Run, judged: tuple[CoefficientTrust, ...]) -> None:
    content = {"contract": CONTRACT, "coefficients": [one.as_json() for one in judged]}
    files.write_json(run.path / FILE, content)


def _read(run: Run) -> tuple[CoefficientTrust, ...] | None:
    """None where a program wrote it that did not compare parts of the data. Raises RunError."""
    path = run.path / FILE
    found = run_files.json_of(path)
    try:
        if any("apart" not in one for one in found["coefficients"]):
            return None
        return tuple(trust.from_json(one) for one in found["coefficients"])
    except (KeyError, TypeError, ValueError) as error:
        raise run_files.unreadable(path, error) from error
