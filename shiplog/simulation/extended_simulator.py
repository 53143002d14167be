"""A model with named causes in it, as a run like any other simulates: windows in, states out.

What the causes say of instruments and actuators is applied before the rollout; what the
instruments would have measured is the output, so that it compares with what was measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from shiplog.exceptions import RunError
from shiplog.models.causes import CATALOGUE, Cause
from shiplog.models.extended import Extended
from shiplog.nomenclature.frames import wrap
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.scoring import window_loss
from shiplog.simulation.sensitivities import rollout
from shiplog.simulation.window_series import WindowSeries
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.windows.windows import Windows

NUMBER_DRAWS = 12  # of the causes' numbers, for the spread of the states
SEED = 0

Shares = Mapping[str, tuple[float, float]]  # voyage → share of the campaign at its start and end


@dataclass(frozen=True)
class ExtendedSimulator:
    """Equations with causes, and all numbers.

    theta        [P + Q]  the base's, then the causes'
    covariance   [P + Q, P + Q]
    shares       of the campaign the causes were found in; later voyages are at its end
    lengths      s of each of its voyages
    """

    model: Extended
    theta: np.ndarray
    covariance: np.ndarray
    profile: Profile
    shares: Shares = field(default_factory=dict)
    lengths: Mapping[str, float] = field(default_factory=dict)

    def simulate(self, windows: Windows) -> np.ndarray:
        """States [N, I, 6] as the instruments would have measured them."""
        return self.states(windows, self.theta)

    def states(self, windows: Windows, theta: np.ndarray) -> np.ndarray:
        recorded = as_record(windows, self.profile, self.shares, self.lengths)
        count = len(self.model.base.names)
        numbers = split(self.model.causes, theta[count:])
        was = recorded
        for cause in self.model.causes:
            was = cause.read(was, numbers[cause.label])
        shape = windows.state.shape
        driven = np.concatenate((_acted(was, recorded, windows), was.share[:, None]), 1)
        data = WindowSeries(
            was.state.reshape(shape),
            driven.reshape(*shape[:2], -1),
            was.true_wind.reshape(*shape[:2], 2),
            windows.dt,
            np.ones(shape[0]),
        )
        with np.errstate(all="ignore"):
            states = rollout(self.model, theta, data, windows.plan["elapsed"].to_numpy())
            if not any(cause.reads for cause in self.model.causes):
                return states
            as_recorded = replace(was, state=states.reshape(-1, 6))
            for cause in reversed(self.model.causes):
                if cause.reads:
                    as_recorded = cause.read(as_recorded, cause.inverse(numbers[cause.label]))
        return as_recorded.state.reshape(shape)

    def with_causes(
        self,
        causes: Sequence[Cause],
        numbers: Mapping[str, np.ndarray],
        covariance: Mapping[str, np.ndarray] | None,
        constants: Mapping[str, np.ndarray] | None = None,
        coefficients: np.ndarray | None = None,
    ) -> ExtendedSimulator:
        """The same model with more causes in it, and its base's `coefficients` [P] as they were
        fitted together with them; of a network its bends [F, 3]. Raises ValueError for
        coefficients of another base."""
        base, own = self.model.base, coefficients
        if own is not None and self.model.bends:
            base, own = base.bend(own), None
        model = replace(
            self.model,
            base=base,
            causes=(*self.model.causes, *causes),
            constants={**self.model.constants, **(constants or {})},
        )
        theta = np.concatenate((self.theta, *(numbers[c.label] for c in causes)))
        if own is not None:
            theta[: len(own)] = own
        whole = np.zeros((len(theta), len(theta)))
        at = len(self.theta)
        whole[:at, :at] = self.covariance
        for cause in causes if covariance is not None else ():
            part = slice(at, at + cause.count)
            whole[part, part] = covariance[cause.label]  # type: ignore[index]
            at += cause.count
        return replace(self, model=model, theta=theta, covariance=whole)

    def losses(self, windows: Windows, theta: np.ndarray | None = None) -> np.ndarray:
        """L of each window [N]."""
        states = self.states(windows, self.theta if theta is None else theta)
        return window_loss(states - windows.state, windows.dt)

    def spread(self, windows: Windows) -> np.ndarray:
        """[N, I, 6] from draws of all numbers: instruments bend what derivatives do not."""
        rng = np.random.default_rng(SEED)
        values, vectors = np.linalg.eigh(self.covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        many = [
            self.states(windows, self.theta + root @ rng.standard_normal(len(self.theta)))
            for _ in range(NUMBER_DRAWS)
        ]
        with np.errstate(all="ignore"):
            return np.nan_to_num(np.std(np.stack(many), axis=0), nan=np.inf)


@dataclass(frozen=True)
class Extension:
    """The causes of an extended run as it is kept.

    numbers, covariance   label → of each cause
    constants             what their forces need and nobody fits
    coefficients          [P] of the base, fitted with them; of a network its bends [F, 3]
    """

    causes: tuple[Cause, ...]
    numbers: Mapping[str, np.ndarray]
    covariance: Mapping[str, np.ndarray]
    constants: Mapping[str, np.ndarray]
    shares: Shares
    lengths: Mapping[str, float]
    coefficients: np.ndarray

    @staticmethod
    def kept(simulator: ExtendedSimulator, base: int) -> tuple[dict, dict[str, np.ndarray]]:
        """JSON and arrays of a simulator whose base has so many coefficients."""
        causes = simulator.model.causes
        numbers = split(causes, simulator.theta[base:])
        facts = {
            "causes": [
                {"name": c.name, "label": c.label, "made": asdict(c),
                 "numbers": numbers[c.label].tolist()}
                for c in causes
            ],
            "shares": {k: list(v) for k, v in simulator.shares.items()},
            "lengths": dict(simulator.lengths),
        }  # fmt: skip
        arrays = {f"constant.{k}": np.atleast_1d(v) for k, v in simulator.model.constants.items()}
        arrays |= {"covariance": simulator.covariance[base:, base:]}
        bent = getattr(simulator.model.base, "bent", None)
        return facts, arrays | {"coefficients": simulator.theta[:base] if bent is None else bent}

    @staticmethod
    def from_record(
        facts: Mapping, arrays: Mapping[str, np.ndarray], own: Sequence[Cause] = ()
    ) -> Extension:
        """Back again; `own`: causes of the user's own. Raises RunError for one nobody knows, and
        ValueError for one of another number of parameters."""
        by = {c.label: c for c in (*CATALOGUE, *own)}
        causes, numbers, covariance, at = [], {}, {}, 0
        for entry in facts["causes"]:
            # of one unit of the ship, the catalogue has the cause without the unit's name
            kind = by.get(entry["label"], by.get(entry["name"]))
            if kind is None:
                raise RunError(
                    f"The run was extended by {entry['label']!r}, which is no cause of shiplog's.",
                    hint="give the file that defines it with --cause FILE.",
                )
            made = {k: tuple(v) if isinstance(v, list) else v for k, v in entry["made"].items()}
            cause = replace(kind, **made)
            causes.append(cause)
            values = np.array(entry["numbers"])
            if len(values) != cause.count:
                raise ValueError(f"{cause.label} has {len(values)} numbers, not {cause.count}")
            part = slice(at, at + cause.count)
            numbers[cause.label] = values
            covariance[cause.label] = np.atleast_2d(arrays["covariance"])[part, part]
            at += cause.count
        constants = {
            k.removeprefix("constant."): v for k, v in arrays.items() if k.startswith("constant.")
        }
        return Extension(
            tuple(causes), numbers, covariance, constants,
            {k: (v[0], v[1]) for k, v in facts["shares"].items()}, dict(facts["lengths"]),
            arrays["coefficients"],
        )  # fmt: skip


def split(causes: Sequence[Cause], numbers: np.ndarray) -> dict[str, np.ndarray]:
    """Numbers [Q], one cause after another, by label."""
    found, at = {}, 0
    for cause in causes:
        found[cause.label] = np.asarray(numbers[at : at + cause.count])
        at += cause.count
    return found


def as_record(
    windows: Windows, profile: Profile, shares: Shares, lengths: Mapping[str, float]
) -> Record:
    """Windows end to end as stretches of a record, a row a sample; an azimuth that passes ±180 deg
    counts on."""
    count, size, _ = windows.state.shape
    actuator = windows.actuator.copy()
    turning = list(profile.azimuths)
    actuator[..., turning] = np.unwrap(actuator[..., turning], axis=1)
    starts = np.zeros((count, size), dtype=bool)
    starts[:, 0] = True
    wind = np.zeros((count, size, 2))
    if windows.wind.shape[-1]:
        speed, angle = windows.wind[..., 0], windows.wind[..., 1]
        wind = np.stack((speed * np.cos(angle), speed * np.sin(angle)), -1)
    names = windows.plan["voyage"].to_list()
    elapsed = windows.plan["elapsed"].to_numpy()[:, None] + windows.since
    share = np.ones((count, size))
    for i, name in enumerate(names):
        if name in shares:
            begin, end = shares[name]
            share[i] = begin + (end - begin) * np.clip(
                elapsed[i] / max(lengths.get(name, 1.0), 1.0), 0.0, 1.0
            )
    known = tuple(dict.fromkeys(names))
    rows = count * size
    return Record(
        profile=profile,
        names=known,
        voyage=np.repeat([known.index(n) for n in names], size),
        time=elapsed.reshape(rows),
        share=share.reshape(rows),
        starts=starts.reshape(rows),
        measured=np.ones(rows, dtype=bool),
        state=windows.state.reshape(rows, 6),
        actuator=actuator.reshape(rows, -1),
        wind=wind.reshape(rows, 2),
        step=float(np.median(windows.dt)),
    )


def _acted(was: Record, recorded: Record, windows: Windows) -> np.ndarray:
    """Actuators [n, A] as they acted, azimuths in (-π, π] as the windows have them."""
    if was.actuator is recorded.actuator:  # no cause is about them
        return windows.actuator.reshape(was.actuator.shape)
    acted, turning = was.actuator.copy(), list(was.profile.azimuths)
    acted[:, turning] = wrap(acted[:, turning])
    return acted


def campaign(record: Record) -> tuple[dict[str, tuple[float, float]], dict[str, float]]:
    """Share of the campaign at each voyage's start and end, and its seconds."""
    shares, lengths = {}, {}
    for i, name in enumerate(record.names):
        rows = np.flatnonzero(record.voyage == i)
        if len(rows):
            shares[name] = (float(record.share[rows[0]]), float(record.share[rows[-1]]))
            lengths[name] = float(record.time[rows[-1]])
    return shares, lengths
