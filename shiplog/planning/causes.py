"""Which causes a manoeuvre would tell apart, before it is sailed, and which sensor would.

The manoeuvre is simulated and read as a trial of `diagnose` is: segments, process noise integrated
out, coefficients and nominal numbers as uncertain as the training voyages leave them. Of the
information A that it has about the causes' numbers, in units of their realistic size x ~ N(0, I),

    A = κM - κM (κM + Λ)⁻¹ κM

the expected log Bayes factor of cause a, which acts, over cause b is the divergence of what both
predict (Kullback & Leibler 1951; Chernoff 1959 chooses experiments by it):

    D(a, b) = ½ (tr(A_aa - A_ab (I + A_bb)⁻¹ A_ba) - tr(A_bb (I + A_bb)⁻¹)
              + ln|I + A_bb| - ln|I + A_aa|),   D(a, nothing) = ½ (tr A_aa - ln|I + A_aa|)

A sensor that measures a cause by itself adds I/ρ² to its own block.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from shiplog.diagnosis.linear import linearisation, segments
from shiplog.diagnosis.linear.measurement_correction import read
from shiplog.diagnosis.noise import part_products
from shiplog.diagnosis.thresholds import SHOWS_NATS
from shiplog.diagnosis.trial import setup, trial_voyages
from shiplog.diagnosis.trial.trial import Trial
from shiplog.nomenclature import frames
from shiplog.simulation.sailing import Sailed
from shiplog.training.runs.load_model import Run
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.store.store import Store

# What measures a cause by itself: words → causes (the contract's names).
SENSORS: dict[str, tuple[str, ...]] = {
    "a speed log through the water": ("current",),
    "a second heading, of two satellite antennas": ("heading_offset",),
    "a second yaw-rate gyro": ("yaw_rate_bias", "yaw_rate_scale"),
    "a second anemometer": ("wind_direction_offset", "wind_speed_scale"),
    "the rudder angle, measured at the stock": ("rudder_offset", "rudder_lag", "rudder_delay"),
    "thrust or torque of the shaft": ("thrust_loss", "thrust_drift"),
    "draught fore and aft": ("payload",),
    "an echo sounder": ("shallow_water",),
    "a distance to the bank (lidar, radar)": ("bank",),
    "a satellite clock for every channel": ("clock_offset",),
    "a survey of the antenna's place": ("antenna_offset",),
}
SENSOR_ACCURACY = 0.1  # ρ, of a cause's realistic size: a tenth is what such sensors have


@dataclass(frozen=True, slots=True)
class Pair:
    """Two causes, and what a manoeuvre says of one against the other.

    nats      the smaller of D(a, b) and D(b, a)
    sensor    what would tell them apart by itself; empty where nothing does, or none is needed
    with_it   nats with that sensor
    """

    a: str
    b: str
    nats: float
    sensor: str
    with_it: float


@dataclass(frozen=True)
class Apart:
    """labels     causes that were asked about
    matrix      [n, n] D(a, b) in nats: rows act
    alone       [n] D(a, nothing)
    pairs       worst first
    untested    label → why it was not asked
    """

    labels: tuple[str, ...]
    matrix: np.ndarray
    alone: np.ndarray
    pairs: tuple[Pair, ...]
    untested: Mapping[str, str]

    @property
    def unseen(self) -> tuple[str, ...]:
        """Causes that would not show at their realistic size."""
        return tuple(n for n, v in zip(self.labels, self.alone, strict=True) if v < SHOWS_NATS)

    @property
    def twins(self) -> tuple[Pair, ...]:
        """Pairs of causes that would show, and not be told apart."""
        return tuple(
            p for p in self.pairs
            if p.nats < SHOWS_NATS and not {p.a, p.b} & set(self.unseen)
        )  # fmt: skip


def trial_of(run: Run, store: Store, sailed: Sequence[Sailed]) -> setup.Setup | None:
    """A trial of simulated manoeuvres, a voyage each, against the run's training voyages; None
    where the store has none of these."""
    there = store.there(run.trained_on)
    if not there:
        return None
    nominal = trial_voyages.record_of(store, there, store.profile(there))
    nominal, _ = trial_voyages.rescale_time(run, nominal, nominal)
    assert nominal is not None
    return setup.trial_of(run, nominal, recorded(sailed, nominal), ())


def recorded(sailed: Sequence[Sailed], nominal: Record) -> Record:
    """What the ship's instruments would have recorded, without noise: at the nominal record's rate
    and in its time scale, after the last of its voyages."""
    parts: dict[str, list[np.ndarray]] = {"voyage": [], "time": [], "state": [], "actuator": [],
                                          "wind": []}  # fmt: skip
    for i, one in enumerate(sailed):
        keep = np.isfinite(one.state[0]).all(-1)
        time, state = one.time[keep], one.state[0][keep]
        fine = np.arange(time[0], time[-1], nominal.step)
        there = np.stack([np.interp(fine, time, column) for column in state.T], 1)
        acts = np.stack([np.interp(fine, time, c) for c in one.actuator[0][keep].T], 1)
        blowing = np.tile(np.array(one.water.wind), (len(fine), 1))
        felt = frames.to_body(blowing, there[:, 4]) + there[:, [1, 3]]
        for name, values in (("voyage", np.full(len(fine), i)), ("time", fine), ("state", there),
                             ("actuator", acts), ("wind", felt)):  # fmt: skip
            parts[name].append(values)
    joined: dict[str, Any] = {name: np.concatenate(values) for name, values in parts.items()}
    count = len(joined["time"])
    return Record(
        profile=nominal.profile, names=tuple(f"planned_{i}" for i in range(len(sailed))),
        share=np.ones(count), starts=np.diff(joined["voyage"], prepend=-1) != 0,
        measured=np.ones(count, dtype=bool), step=nominal.step, timescale=nominal.timescale,
        **joined,
    )  # fmt: skip


def apart(made: setup.Setup, run: Run) -> list[Apart]:
    """Of each manoeuvre of the trial by itself. Raises np.linalg.LinAlgError where the model
    diverges in one."""
    trial = made.trial
    held = {label: np.asarray(values) for label, values in run.extension_numbers().items()}
    return [judge(trial, gram, held, made.untested) for gram in products(trial, held)]


def products(trial: Trial, numbers: Mapping[str, np.ndarray]) -> list[np.ndarray]:
    """G [1 + C, 1 + C] of each manoeuvre, in units, linearised as a trial's voyages are."""
    ref, record = trial.reference, trial.record
    whole = np.concatenate((ref.theta, ref.columns.numbers(dict(numbers))))
    rows = segments.begins(record)
    cut, moved, observed = read(ref.model, ref.setting, record, rows, dict(numbers))
    grid = segments.grid(record)
    path = linearisation.fit_path(ref.model, whole, cut, grid, ref.wide, rounds=1)
    linear = linearisation.linear(ref.model, whole, cut, grid, path, moved, observed)
    if linear.lost.all():
        raise np.linalg.LinAlgError("the model diverges in every segment of the manoeuvres")
    accelerations = None if ref.misfit is None else ref.misfit.accelerations(cut, grid)
    prior = ref.process_noise.inverse_kernels(grid.nodes)
    weight = np.where(linear.lost, 0.0, 1.0)
    return [
        part_products.part_pass(
            linear, ref.process_noise, np.flatnonzero(cut.voyage == i), ref.columns.unit, weight,
            accelerations,
        ).gram(prior).G
        for i in range(len(record.names))
    ]  # fmt: skip


def judge(
    trial: Trial, gram: np.ndarray, held: Mapping[str, np.ndarray], untested: Mapping[str, str]
) -> Apart:
    """D of every pair of causes that the model has not already."""
    ref = trial.reference
    M = ref.counts * gram[1:, 1:]
    A = M - M @ np.linalg.solve(M + ref.information, M)
    columns = {n: c for n, c in ref.columns.indices.items() if n not in held}
    names = {c.label: c.name for c in ref.model.causes}
    return divergences(A, columns, names, untested)


def divergences(
    A: np.ndarray, columns: Mapping[str, np.ndarray], names: Mapping[str, str],
    untested: Mapping[str, str] | None = None,
) -> Apart:  # fmt: skip
    """Of the information A [C, C]; `names`: label → the contract's name of that cause."""
    labels = tuple(columns)
    matrix = np.array([[divergence(A, columns[a], columns[b]) if a != b else 0.0 for b in labels]
                       for a in labels])  # fmt: skip
    alone = np.array([divergence(A, columns[a], np.zeros(0, int)) for a in labels])
    pairs = []
    for i, j in combinations(range(len(labels)), 2):
        a, b = labels[i], labels[j]
        nats = float(min(matrix[i, j], matrix[j, i]))
        sensor, with_it = ("", nats) if nats >= SHOWS_NATS else _sensor(A, columns, names, a, b)
        pairs.append(Pair(a, b, nats, sensor, with_it))
    pairs.sort(key=lambda pair: pair.nats)
    return Apart(labels, matrix, alone, tuple(pairs), untested or {})


def divergence(A: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    """D(a, b) of columns a [n] and b [m]; b is empty for nothing."""
    inside, other = A[np.ix_(a, a)], A[np.ix_(b, b)]
    across = A[np.ix_(b, a)]
    wider = other + np.eye(len(b))
    square = np.trace(inside) - np.trace(across.T @ np.linalg.solve(wider, across))
    square -= np.trace(np.linalg.solve(wider, other))
    volume = np.linalg.slogdet(wider)[1] - np.linalg.slogdet(inside + np.eye(len(a)))[1]
    return max(0.5 * float(square + volume), 0.0)


def _sensor(
    A: np.ndarray, columns: Mapping[str, np.ndarray], names: Mapping[str, str], a: str, b: str
) -> tuple[str, float]:
    """The sensor with which a and b are told apart best, and nats with it: one that measures one
    of them and not the other."""
    best, most = "", 0.0
    for words, measures in SENSORS.items():
        mine = [n for n in (a, b) if names[n] in measures]
        if len(mine) != 1:
            continue
        more = A.copy()
        own = columns[mine[0]]
        more[np.ix_(own, own)] += np.eye(len(own)) / SENSOR_ACCURACY**2
        nats = min(divergence(more, columns[a], columns[b]),
                   divergence(more, columns[b], columns[a]))  # fmt: skip
        if nats > most:
            best, most = words, nats
    return best, most
