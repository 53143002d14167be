"""A diagnosis as the tables that the viewer draws."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl

from shiplog.diagnosis.hypotheses import intermittent
from shiplog.diagnosis.linear import linearisation, segment_nodes
from shiplog.diagnosis.linear.measurement_correction import corrected
from shiplog.diagnosis.noise import residual_acceleration
from shiplog.diagnosis.noise.residual_acceleration import means_about
from shiplog.diagnosis.onset.recorded_time import offsets
from shiplog.diagnosis.residual import external_forces
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict.result import SIDE_THRUST, Decision
from shiplog.exceptions import listed
from shiplog.nomenclature.channels import STATE, VELOCITY
from shiplog.report.diagnosis import page
from shiplog.report.diagnosis.diagnosis import Diagnosis
from shiplog.report.viewer.comparison_data import Current, MadeFast
from shiplog.report.viewer.diagnosis_data import (
    ACTING,
    AFTER,
    BEFORE,
    ERROR_COLUMNS,
    TRACKS,
    Exhibit,
)
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.windows.windows import Windows

NOT_DRAWN = 1e6  # m, m/s: a rollout beyond has left the pond, and is not drawn


def exhibit(done: Diagnosis) -> Exhibit:
    """Of a diagnosis that came to a decision."""
    trial, decision = done.trial, done.decision
    assert trial is not None and decision is not None
    profile = trial.record.profile
    residual, named = _residual(done)
    rollouts, errors = _before_and_after(done)
    return Exhibit(
        title=f"{profile.ship.name}: {listed(trial.record.names, most=3)}",
        ship_length=profile.ship.length_m,
        ship_breadth=profile.ship.breadth,
        ship_outline=profile.ship.outline or (),
        banks=profile.site.banks,
        measured=_measured(trial.record),
        residual=residual,
        named=named,
        extended=tuple(n.cause.label for n in decision.named) if done.after is not None else (),
        tracks=rollouts,
        errors=errors,
        report=page.markdown(done.verdict),
        run=Path(done.verdict.run).name,
        datums=done.datums,
        current=_current(decision),
        made_fast=_made_fast(decision),
        acting=_acting(done),
    )


def _acting(done: Diagnosis) -> pl.DataFrame:
    """P(acts) of each named cause, level over each stretch, in its voyage's own time."""
    assert done.trial is not None
    record = done.trial.record
    begins = dict(zip(record.names, offsets(record).tolist(), strict=False))
    rows = []
    for label, course in done.courses.items():
        if (onset := course.onset) is None:
            continue
        ends = zip(onset.edges[:-1].tolist(), onset.edges[1:].tolist(), strict=True)
        for voyage, p, (begin, end) in zip(onset.voyages, onset.acting.tolist(), ends, strict=True):
            rows += [(label, voyage, at - begins[voyage], p) for at in (begin, end)]
    return pl.DataFrame(rows, ACTING, orient="row")


def _current(decision: Decision) -> Current | None:
    """Towards where the named current sets."""
    for named in decision.named:
        if named.cause.label == "current":
            north, east = (float(one) for one in named.numbers)
            return Current(float(np.hypot(north, east)), float(np.arctan2(east, north)))
    return None


def _made_fast(decision: Decision) -> MadeFast | None:
    """Where the named line goes to, if it has a place."""
    for named in decision.named:
        at = named.estimates if named.cause.label == "line" else {}
        if {"x0", "y0"} <= set(at):
            x0, y0 = at["x0"], at["y0"]
            return MadeFast((x0.value, y0.value), (x0.low, y0.low), (x0.high, y0.high))
    return None


def _measured(record: Record) -> pl.DataFrame:
    """About a row a second."""
    rows = np.flatnonzero(record.measured)
    rows = rows[:: max(1, round(1.0 / record.step))]
    index = {"voyage": [record.names[i] for i in record.voyage[rows]], "time": record.time[rows]}
    return pl.DataFrame(index | _columns(record.state[rows]) | _apparent_wind(record, rows))


def _apparent_wind(record: Record, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Its speed and angle, where it was measured."""
    if not record.profile.has_wind:
        return {}
    ahead, starboard = record.wind[rows].T
    return {"wind_speed": np.hypot(ahead, starboard), "wind_angle": np.arctan2(starboard, ahead)}


# --- forces ---------------------------------------------------------------------------------------


def _residual(done: Diagnosis) -> tuple[pl.DataFrame, tuple[str, ...]]:
    """Unexplained and named force at the nodes, and what the latter is of."""
    assert done.simulated is not None and done.whole is not None
    (trial, decision), whole = done.simulated, done.whole
    ref, record = trial.reference, trial.record
    nothing = decision.nothing
    nominal = ref.mean * ref.columns.unit
    process_noise = trial.process_noise(nothing.remainder, whole.cut)
    process_noise = process_noise.times(nothing.estimate.noise_factor)
    residual = trial.less_misfit(whole, nominal)
    found = residual_acceleration.posterior(*residual, process_noise, record)
    keep = residual_acceleration.unique_instants(found)
    order = np.argsort(found.rows[keep])
    rows = found.rows[keep][order]
    mean, sd = (np.moveaxis(v, 1, -1)[keep][order] for v in (found.mean, found.sd))
    # columns: the force that one m/s² (rad/s²) takes
    mass = external_forces.masses(ref.model.stand_in, np.array(list(ref.coefficients.values()))).T
    names = [n.cause.label for n in decision.named if n.cause.kind != "sensor"]
    force = _caused(trial, decision, rows) @ mass.T
    if decision.side_force is not None:
        names.append(SIDE_THRUST)
        assert done.trial is not None and done.decision is not None
        force = force + _side_force(done.trial, done.decision)[rows]
    if not names:
        force = np.full_like(force, np.nan)
    index = {"voyage": [record.names[i] for i in record.voyage[rows]], "time": record.time[rows]}
    columns = zip(VELOCITY, (mean @ mass.T).T, np.sqrt(sd**2 @ mass.T**2).T, force.T, strict=True)
    tables = [
        pl.DataFrame(index | {"force": left, "sd": doubt, "named": caused}).with_columns(
            pl.lit(channel.name).alias("channel"), pl.col("named").fill_nan(None)
        )
        for channel, left, doubt, caused in columns
    ]
    return pl.concat(tables), tuple(names)


def _caused(trial: Trial, decision: Decision, rows: np.ndarray) -> np.ndarray:
    """ν̇ [n, 3] that the named causes add where the ship was: a wrong instrument adds none."""
    ref = trial.reference
    fixed = dict(decision.nothing.point.numbers)
    named = {n.cause.label: n.numbers for n in decision.named if n.cause.kind != "sensor"}
    nominal = np.concatenate((ref.theta, np.zeros(ref.columns.linearised - ref.columns.base)))
    nominal += (ref.mean * ref.columns.unit)[: len(nominal)]

    def acceleration(numbers: dict[str, np.ndarray]) -> np.ndarray:
        theta = nominal.copy()
        theta[ref.columns.base :] += ref.columns.numbers(numbers)
        was = corrected(ref.model.causes, trial.record, numbers)
        driven = np.concatenate((was.actuator, was.share[:, None]), 1)
        state, driven, wind = (
            means_about(was, v, rows) for v in (was.state, driven, was.true_wind)
        )
        # by as many as a segment has nodes: that shape is compiled already
        blocks = -(-len(rows) // trial.grid.nodes)
        state, driven = (
            np.resize(values, (blocks, trial.grid.nodes, values.shape[1]))
            for values in (state, np.concatenate((driven, wind), 1))
        )
        found = linearisation.accelerations(ref.model, theta, state, driven)
        return found.reshape(-1, 3)[: len(rows)]

    return acceleration(fixed | named) - acceleration(fixed)


def _side_force(trial: Trial, decision: Decision) -> np.ndarray:
    """Force [n, 3] of the thruster that nobody records, at rows that are nodes."""
    assert decision.side_force is not None
    force, _ = intermittent.force_at_nodes(trial, decision.fit, decision.side_force)
    whole = np.full(len(trial.record), np.nan)
    whole[segment_nodes.rows_of_nodes(trial.rows, trial.grid)] = force
    return whole[:, None] * np.array([0.0, 1.0, decision.side_force.lever])


# --- windows --------------------------------------------------------------------------------------


def _before_and_after(done: Diagnosis) -> tuple[pl.DataFrame, pl.DataFrame]:
    """Tracks and errors of every window; after, by numbers that were fitted without its voyage."""
    held, decision = done.held, done.decision
    if held is None or decision is None:
        return pl.DataFrame(schema=TRACKS), pl.DataFrame(schema=ERROR_COLUMNS)
    cut = held.cut
    states = {BEFORE: held.states_before}
    if done.after is not None:
        states[AFTER] = held.states_after(decision)
    index = numbered(cut)
    errors = index.with_columns(
        pl.Series("seconds", cut.dt.sum(1)),
        *(
            pl.Series(k, np.where(held.counted, held.parts(v).sum(1), np.nan)).fill_nan(None)
            for k, v in states.items()
        ),
    )
    if AFTER not in states:
        errors = errors.with_columns(pl.lit(None, pl.Float64).alias(AFTER))
    simulated = [tracks(name, values, index, cut) for name, values in states.items()]
    return pl.concat(simulated), errors.select(ERROR_COLUMNS.keys())


def numbered(cut: Windows) -> pl.DataFrame:
    """voyage, window (counted in each voyage), time: a row a window."""
    return cut.plan.select(
        "voyage", pl.int_range(pl.len()).over("voyage").alias("window"),
        pl.col("elapsed").alias("time"),
    )  # fmt: skip


def tracks(model: str, states: np.ndarray, windows: pl.DataFrame, cut: Windows) -> pl.DataFrame:
    """A row a sample; what has left the pond is null."""
    count, size, _ = states.shape
    gone = np.logical_or.accumulate(~(np.abs(states).max(-1) < NOT_DRAWN), axis=1)
    states = np.where(gone[..., None], np.nan, states)
    index = windows[np.repeat(np.arange(count), size)]
    return (
        index.with_columns(
            pl.lit(model).alias("model"), pl.col("time") + pl.Series(cut.since.reshape(-1))
        )
        .hstack(pl.DataFrame(_columns(states.reshape(-1, 6))))
        .select(TRACKS.keys())
    )


def _columns(states: np.ndarray) -> dict[str, np.ndarray]:
    return {channel.name: states[:, i] for i, channel in enumerate(STATE)}
