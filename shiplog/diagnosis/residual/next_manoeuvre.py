"""The manoeuvre that would separate two causes, and its expected evidence, simulated in advance.

The expected evidence is the information of the simulated manoeuvre about a cause's numbers p,
without the part that coefficients, nominal numbers or the other cause could imitate: with products
κ M of the manoeuvre, the prior information Λ, and rows a of the cause and b of the other,

    A = κ M - κ M (κ M + Λ)⁻¹ κ M
    nats = ½ (pᵀ A_aa p - (A_ba p)ᵀ (A_bb + I)⁻¹ (A_ba p))
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.diagnosis.linear import linearisation, segments
from shiplog.diagnosis.linear.measurement_correction import read
from shiplog.diagnosis.noise import part_products
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict.result import Named
from shiplog.nomenclature import frames
from shiplog.simulation.sensitivities import rollout
from shiplog.simulation.window_series import WindowSeries
from shiplog.voyages.rows.recording import Record

MANOEUVRE_S = 300.0  # of a manoeuvre of a three-metre ship; other ships take theirs in ship time
SIMULATION_STEP_S = 0.5  # s of the simulation
HARD = np.radians(35.0)  # farther no rudder is laid, and no thruster turned
# Ship lengths from the datum, eight times as far as a ship goes in a manoeuvre at its working
# speed: a simulation beyond has diverged. 1 km of a three-metre ship, 33 km of one of 100 m.
OFF_THE_POND = 330.0


@dataclass(frozen=True)
class Manoeuvre:
    """Thrust and steering at times t [n], as shares of what the voyages used; starts at rest.

    words   with a place for every one of `times` [s]: both are of a three-metre ship, as t is
    """

    words: str
    drive: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    times: tuple[float, ...] = ()

    def text(self, factor: float) -> str:
        """The words, for a ship whose time scale is `factor` times that of a three-metre ship."""
        return self.words.format(*(f"{factor * time:.0f} s" for time in self.times))


def _constant(t: np.ndarray, share: float) -> np.ndarray:
    """The same share at all times t [n]."""
    return np.full(len(t), share)


def _square_wave(t: np.ndarray, half: float) -> np.ndarray:
    """1 and -1, so many seconds each."""
    return np.where((t // half) % 2 < 1, 1.0, -1.0)


MANOEUVRES = (
    Manoeuvre(
        "one slow full turn to either side",
        lambda t: (_constant(t, 0.6), 0.4 * _square_wave(t, 150.0)),
    ),
    Manoeuvre(
        "a zigzag, {} to either side",
        lambda t: (_constant(t, 0.8), 0.8 * _square_wave(t, 30.0)),
        (30.0,),
    ),
    Manoeuvre(
        "doublets of {} at constant revolutions",
        lambda t: (_constant(t, 0.7), _square_wave(t, 3.0)),
        (3.0,),
    ),
    Manoeuvre(
        "full power and no power in turn, {} each, on a straight course",
        lambda t: (0.5 + 0.5 * _square_wave(t, 60.0), _constant(t, 0.0)),
        (60.0,),
    ),
    Manoeuvre(
        "bursts of full power from rest, {} every {}",
        lambda t: (np.where(t % 60.0 < 10.0, 1.0, 0.0), _constant(t, 0.0)),
        (10.0, 60.0),
    ),
    Manoeuvre(
        "the same course out and back",
        lambda t: (_constant(t, 0.7), np.where((t > 110.0) & (t < 150.0), 0.9, 0.0)),
    ),
    Manoeuvre("a drifting stop", lambda t: (np.where(t < 40.0, 0.7, 0.0), _constant(t, 0.0))),
)


@dataclass(frozen=True)
class Advice:
    """What to sail next, for how long [s], and the evidence expected of it [nats]."""

    words: str
    seconds: float
    nats: float


def advice(
    trial: Trial, named: Sequence[Named], fixed: Mapping[str, np.ndarray]
) -> dict[str, Advice]:
    """Label → the manoeuvre that separates it best from its aliases.

    fixed   numbers of the causes that the model has already
    """
    alike = {n.cause.label: n for n in named if n.alike}
    if not alike:
        return {}
    grams, factor = products_of_manoeuvres(trial, fixed), trial.record.timescale.factor
    found = {}
    for label, one in alike.items():
        worth = {
            m.text(factor): min(separation(trial, gram, one, other) for other in one.alike)
            for m, gram in zip(MANOEUVRES, grams, strict=True)
            if gram is not None
        }
        if worth:
            best = max(worth, key=lambda words: worth[words])
            found[label] = Advice(best, factor * MANOEUVRE_S, worth[best])
    return found


def separation(trial: Trial, gram: np.ndarray, one: Named, other: str) -> float:
    """½ (pᵀ A_aa p - (A_ba p)ᵀ (A_bb + I)⁻¹ (A_ba p)): nats by which a cause a, with its numbers p
    as they were found, would beat another, b.

    gram   G [1 + C, 1 + C] of a manoeuvre, in units, with M its block of numbers. A = κM - κM (κM
           + Λ)⁻¹ κM: a manoeuvre counts as much of itself, κ, as a trial does.
    """
    columns = trial.reference.columns
    a, b = columns.indices[one.cause.label], columns.indices[other]
    M = trial.reference.counts * gram[1:, 1:]
    A = M - M @ np.linalg.solve(M + trial.reference.information, M)
    p = one.numbers / columns.unit[a]
    A_ba_p = A[np.ix_(b, a)] @ p
    A_bb = A[np.ix_(b, b)] + np.eye(len(b))
    return 0.5 * float(p @ A[np.ix_(a, a)] @ p - A_ba_p @ np.linalg.solve(A_bb, A_ba_p))


def products_of_manoeuvres(
    trial: Trial, fixed: Mapping[str, np.ndarray]
) -> list[np.ndarray | None]:
    """G = Σ_s G_s [1 + C, 1 + C] of each manoeuvre, in units, its segments linearised as a trial's
    are; None where the model diverges in it."""
    ref = trial.reference
    numbers = dict(fixed)
    whole = np.concatenate((ref.theta, ref.columns.numbers(numbers)))
    recorded, kept = simulated(trial, whole)
    rows = segments.begins(recorded)
    cut, moved, observed = read(ref.model, ref.setting, recorded, rows, numbers)
    grid = segments.grid(recorded)
    path = linearisation.fit_path(ref.model, whole, cut, grid, ref.wide, rounds=1)
    linear = linearisation.linear(ref.model, whole, cut, grid, path, moved, observed)
    accelerations = None if ref.misfit is None else ref.misfit.accelerations(cut, grid)
    parts = [np.flatnonzero(cut.voyage == i) for i in range(len(MANOEUVRES))]
    prior = ref.process_noise.inverse_kernels(grid.nodes)
    return [
        part_products.part_pass(
            linear, ref.process_noise, own, ref.columns.unit, np.ones(len(linear.e)), accelerations
        )
        .gram(prior)
        .G
        if stayed and len(own)
        else None
        for own, stayed in zip(parts, kept, strict=True)
    ]


def simulated(trial: Trial, theta: np.ndarray) -> tuple[Record, np.ndarray]:
    """All manoeuvres in the trial's mean wind, a voyage each; which stayed in the pond [M]."""
    record, model = trial.record, trial.reference.model
    factor = record.timescale.factor
    time = np.arange(0.0, factor * MANOEUVRE_S + SIMULATION_STEP_S, SIMULATION_STEP_S)
    actuator = np.stack([driven(record, m, time / factor) for m in MANOEUVRES])
    count, rows = actuator.shape[:2]
    wind = np.broadcast_to(record.true_wind[record.measured].mean(0), (count, rows, 2))
    share = np.full((count, rows, 1), record.share[-1])
    series = WindowSeries(
        np.zeros((count, rows, 6)), np.concatenate((actuator, share), -1), np.array(wind),
        np.full((count, rows - 1), SIMULATION_STEP_S), np.ones(count),
    )  # fmt: skip
    with np.errstate(all="ignore"):
        states = rollout(model, theta, series)
    kept = np.abs(states).max((1, 2)) < OFF_THE_POND * trial.reference.setting.scale["length"]
    states = np.where(kept[:, None, None], states, 0.0)
    fine = np.arange(0.0, factor * MANOEUVRE_S, record.step)

    def between(values: np.ndarray) -> np.ndarray:
        every = [np.interp(fine, time, column) for one in values for column in one.T]
        return np.moveaxis(np.reshape(every, (count, -1, len(fine))), 1, 2).reshape(
            count * len(fine), -1
        )

    state = between(states)
    felt = frames.to_body(between(series.wind), state[:, 4]) + state[:, [1, 3]]
    whole = count * len(fine)
    return Record(
        profile=record.profile,
        names=tuple(m.words for m in MANOEUVRES),
        voyage=np.repeat(np.arange(count), len(fine)),
        time=np.tile(fine, count),
        share=np.full(whole, record.share[-1]),
        starts=np.tile(np.arange(len(fine)) == 0, count),
        measured=np.ones(whole, dtype=bool),
        state=state,
        actuator=between(actuator),
        wind=felt,
        step=record.step,
        timescale=record.timescale,
    ), kept


def driven(record: Record, manoeuvre: Manoeuvre, time: np.ndarray) -> np.ndarray:
    """share(t) · quantile₀.₉₅|actuator| [n, A], SI; of a rudder or an azimuth HARD at most."""
    thrust, steering = manoeuvre.drive(time)
    most = np.quantile(np.abs(record.actuator[record.measured]), 0.95, axis=0)
    columns = []
    for actuator, own in zip(record.profile.actuators, most, strict=True):
        steers = actuator.kind in ("rudder", "azimuth")
        columns.append(steering * min(float(own), HARD) if steers else thrust * own)
    return np.stack(columns, -1)
