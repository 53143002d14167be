"""Where a model errs: by channel, outside its training data, where an external force acts.

All of it is of the residual e - J d of the model as it stands, its discrepancy and the parts' own
numbers taken out.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import polars as pl

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import evidence, fits
from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.diagnosis.noise import residual_acceleration
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.residual import external_forces, omitted_inputs
from shiplog.diagnosis.residual.interval import Interval
from shiplog.diagnosis.residual.omitted_inputs import Dependence
from shiplog.diagnosis.trial.fitted import Fit, Point
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict.held_out import HeldOut
from shiplog.ship_profile.profile import Profile
from shiplog.simulation import coverage as covering
from shiplog.simulation import error_breakdown
from shiplog.simulation.extended_simulator import campaign
from shiplog.simulation.window_series import series
from shiplog.training.runs.load_model import Run
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.windows import Windows


def find_external_forces(
    trial: Trial, point: Point, whole: Linear, remainder: Remainder, nominal: Record | None
) -> tuple[list[Interval], np.ndarray]:
    """Stretches that no force of the ship explains, and the segments [S] bool that they touch: what
    is fitted after the decision leaves those out. The point is of the model as it stands, `whole`
    its pass with the segments between its own; `nominal` the voyages of the nominal campaign, if
    there is one."""
    ref = trial.reference
    physics, values = ref.model.stand_in, np.array(list(ref.coefficients.values()))
    base, _ = evidence.scan(trial, point, (), trial.fixed, remainder=remainder)
    fit = Fit(point, base, remainder)
    residual, d = fits.residual(trial, fits.less_parts(trial, whole, fit), fit)
    process_noise = trial.process_noise(remainder, whole.cut).times(base.noise_factor)
    found: tuple[external_forces.Stretch, ...] = ()
    if external_forces.has_propulsion(physics):
        weighed = external_forces.balance(residual, d, process_noise, trial.record, physics, values)
        found = external_forces.find(weighed, trial.record)
        if found and nominal is not None:
            found = external_forces.find(weighed, trial.record, _nominal_excess(trial, nominal))
    out = np.zeros(len(trial.rows), dtype=bool)
    of = np.array(trial.record.names)[trial.record.voyage[trial.rows]]
    begin = trial.record.time[trial.rows]
    for stretch in found:
        inside = (begin < stretch.end_s) & (begin + trial.grid.seconds > stretch.start_s)
        out |= inside & (of == stretch.voyage)
    intervals = [Interval(s.voyage, s.start_s, s.end_s, "external", s.sentence) for s in found]
    return intervals, out


def _nominal_excess(trial: Trial, nominal: Record) -> np.ndarray | None:
    """As `external_forces.largest_excess`, of the nominal voyages; None where they are unknown."""
    ref, left = trial.reference, trial.campaign.residual(nominal)
    if left is None:
        return None
    weighed = external_forces.balance(
        left, np.zeros(left.j.shape[-1]), ref.process_noise, nominal, ref.model.stand_in,
        np.array(list(ref.coefficients.values())),
    )  # fmt: skip
    return external_forces.largest_excess(weighed, nominal)


def errors_by_channel(held: HeldOut) -> list[dict]:
    """Shares of the error of the windows, as the contract's `wrong`."""
    shares, _ = campaign(held.trial.record)
    share = [shares.get(v, (1.0, 1.0))[0] for v in held.voyages]
    plan = held.cut.plan.with_columns(share=pl.Series(share))
    error = held.states_before - held.cut.state
    found = error_breakdown.explain(error, series(held.cut), plan, held.trial.record.profile)
    return [c.as_json() for c in found.channels]


def find_omitted_inputs(trial: Trial, nothing: Fit, whole: Linear) -> tuple[Dependence, ...]:
    """What the model cannot see and the residual depends on, with no cause named."""
    found = residual_acceleration.posterior(
        *fits.residual(trial, whole, nothing),
        trial.process_noise(nothing.remainder, whole.cut).times(nothing.estimate.noise_factor),
        trial.record,
    )  # fmt: skip
    nodes = residual_acceleration.table(found, trial.record)
    trial.cache.release()
    return omitted_inputs.table(
        nodes, trial.record.profile, np.random.default_rng(0), node_step=trial.grid.node_step
    )


def uncovered_windows(
    run: Run, store: Store, names: Sequence[str], profile: Profile, cut: Windows
) -> list[Interval]:
    """Windows outside the training data."""
    rows = store.seconds(names, profile)
    trained = covering.learn(run.training(), profile.actuator_names, profile.has_wind)
    numbered = cut.plan.select(
        "voyage", pl.int_range(pl.len()).over("voyage").alias("window"), "segment", "start",
        "elapsed",
    )  # fmt: skip
    size = run.config.window
    whole = numbered.hstack(trained.table(rows, numbered, size))
    found = []
    for row in whole.filter(pl.col("coverage") < thresholds.COVERED).to_dicts():
        within = rows.filter(
            (pl.col("voyage") == row["voyage"])
            & pl.col("elapsed").is_between(row["elapsed"], row["elapsed"] + size - 1)
        )
        why = covering.reason(row, within) or "unlike anything in the training data"
        found.append(
            Interval(
                row["voyage"], float(row["elapsed"]), float(row["elapsed"] + size), "coverage",
                f"Only {row['coverage']:.0%} of these seconds are inside the training data: {why}.",
            )
        )  # fmt: skip
    return found
