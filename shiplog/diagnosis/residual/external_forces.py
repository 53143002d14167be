"""Intervals that no force of the ship can explain: it was pushed, caught, towed or held.

The residual acceleration times mass and added mass is compared with the largest force of the ship:
screws at full power, rudders at every angle in their slipstream, wind, hull, and the model's
nominal error. A larger force is external. Where the nominal voyages have as large a force, which
nothing pushed, it is an error of the model and not external. At each node, in each channel,

    F = M a,  sd² = M² sd_a²,  a | e ~ N(â, sd_a²)                              `balance`
    own = |X_H(x)| + bollard forces + (1.2 U_A)² max_α |X_A(α)|
    misfit = √max((1.4826 median|F|)² - median(sd)², 0)                of the whole record
    |F| - own - EXTERNAL_SPREADS sd > max(EXTERNAL_MISFIT misfit, nominal excess)   `find`
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.diagnosis.noise import residual_acceleration
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.noise.residual_acceleration import Unexplained
from shiplog.models.mmg import MMG, body
from shiplog.models.mmg import wind as air
from shiplog.models.mmg.model import named
from shiplog.nomenclature import channels, frames
from shiplog.voyages.rows.fault_detection import jumps, stretches
from shiplog.voyages.rows.recording import Record

CHANNELS = tuple(c.name for c in channels.VELOCITY)
UNITS = 300.0  # per cent of full thrust: a push by three ships of its size, or a wrong unit
GUST = 1.2  # of the measured wind speed, from whichever side is worst
STILL = 0.05  # of full power: below, a screw stands
JETS_GONE_S = 5.0  # s that screws have stood before their jets are gone
RESTING = 0.5  # of its means that stay allowed then: a thruster that nobody records
DOUBT = 5.0  # s around a jump of position or heading, where velocities are not believed
SHORTEST_S = 2.0  # s of an event
GAP = 5.0  # s: after a shorter break it is still the same event
EDGE = 0.5  # an event begins and ends where its force passes half of the peak
LOOSE = 0.5  # of its full acceleration: how far the nodes may go before data pull them
ANGLES = 13  # settings of a rudder that are tried
TOWARDS = (("ahead", "astern"), ("to starboard", "to port"), ("to starboard", "to port"))


@dataclass(frozen=True, slots=True)
class Stretch:
    """One event, in the channel where it exceeds the ship's own forces most.

    peak     the largest force [N], or moment [N m] where the channel is yaw_rate
    percent  of full thrust; of its full turning moment where the channel is yaw_rate; infinite
             where the ship has none, such as a ship in tow whose screws never turned
    """

    voyage: str
    start_s: float
    end_s: float
    channel: str
    peak: float
    percent: float

    @property
    def sentence(self) -> str:
        towards = TOWARDS[CHANNELS.index(self.channel)][0 if self.peak > 0.0 else 1]
        turning = self.channel == "yaw_rate"
        what, unit, full = (
            ("moment", "N m", "its full turning moment")
            if turning
            else ("force", "N", "full thrust")
        )
        share = f" ({self.percent:.0f} % of {full})" if math.isfinite(self.percent) else ""
        asked = UNITS < self.percent < math.inf
        units = " Units? So large a force may be a wrong unit, sign or place in the profile."
        return (
            f"A {what} of {abs(self.peak):.3g} {unit} {towards}{share} "
            f"for {self.end_s - self.start_s:.0f} s: pushed, towed or held; no force of its own "
            f"does that.{units if asked else ''}"
        )


@dataclass(frozen=True)
class Balance:
    """Along K nodes, in order, X, Y [N] and N [N m] at midship.

    rows   [K]     of the record
    force  [K, 3]  F = M a, unexplained
    sd     [K, 3]  its standard deviation
    own    [K, 3]  what ship, wind and hull could add there
    misfit [3]     what the model misses always
    full   [3]     the ship's own means, at bollard
    """

    rows: np.ndarray
    force: np.ndarray
    sd: np.ndarray
    own: np.ndarray
    misfit: np.ndarray
    full: np.ndarray

    @property
    def excess(self) -> np.ndarray:
        """|F| - own - EXTERNAL_SPREADS sd [K, 3] N, N and N m, by which the force significantly
        exceeds the ship's own."""
        return np.abs(self.force) - self.own - thresholds.EXTERNAL_SPREADS * self.sd


def has_propulsion(physics: MMG) -> bool:
    """Whether it is known what drives the ship: else no force can be called external."""
    return bool(physics.geometry.propellers or physics.geometry.thrusters)


def find(
    weighed: Balance, record: Record, nominal_excess: np.ndarray | None = None
) -> tuple[Stretch, ...]:
    """Stretches in which excess > max(EXTERNAL_MISFIT misfit, nominal excess): all events of a
    record, in order of voyage and time.

    nominal_excess  [3] N, N and N m, as `largest_excess` gives it for the nominal voyages; None
                    without any
    """
    allowed = thresholds.EXTERNAL_MISFIT * weighed.misfit
    if nominal_excess is not None:
        allowed = np.maximum(allowed, nominal_excess)
    beyond = weighed.excess > allowed
    beyond &= ~_contradicted(record, weighed.rows)[:, None]
    found = []
    for part in _unbroken(record, weighed.rows):
        for channel in range(3):
            for first, last in stretches(beyond[part, channel]):
                limit = weighed.own[part, channel] + allowed[channel]
                found.append(_event(record, weighed, limit, part, channel, first, last))
    return tuple(_merged(found, record.names))


def largest_excess(weighed: Balance, record: Record) -> np.ndarray:
    """max over nodes of excess [3] N, N and N m, at least 0: the most by which the forces of a
    record exceed the ship's own."""
    kept = ~_contradicted(record, weighed.rows)
    return weighed.excess[kept].max(0, initial=0.0)


def balance(
    linear: Linear,
    d: np.ndarray,
    process_noise: ProcessNoise,
    record: Record,
    physics: MMG,
    values: np.ndarray,
) -> Balance:
    """The forces that `find` judges: F = M a and sd, own, misfit (the module's equations). The
    process noise is as loose as LOOSE times the acceleration that the ship's own means could make,
    M⁻¹ `full`.

    linear   of a record's segments, best those of `residual_acceleration.covering`
    d        [C] the columns' numbers, SI
    physics  an MMG of the ship, for masses and means, with its coefficients `values` [P]
    """
    M = masses(physics, values).T
    full = largest_own_forces(record, physics, values)
    reach = np.abs(np.linalg.solve(M, full))
    loose = replace(
        process_noise, acceleration=np.maximum(process_noise.acceleration, LOOSE * reach)
    )
    rows, acceleration, sd = _nodes_of(residual_acceleration.posterior(linear, d, loose, record))
    F = acceleration @ M.T
    sd_F = np.sqrt(sd**2 @ M.T**2)
    spread = 1.4826 * np.median(np.abs(F), axis=0)
    misfit = np.sqrt(np.maximum(spread**2 - np.median(sd_F, axis=0) ** 2, 0.0))
    state = residual_acceleration.means_about(record, record.state, rows)
    actuator = residual_acceleration.means_about(record, record.actuator, rows)
    own = np.abs(_forces(physics, values, state, actuator)["hull"])
    own += np.where(_resting(record, physics, rows), RESTING, 1.0)[:, None] * full
    if physics.geometry.wind:
        angle = np.linspace(0.0, 2.0 * math.pi, 73)
        worst = np.abs(
            air.wind(named(physics.names, values), physics.geometry, np.cos(angle), np.sin(angle))
        ).max(0)
        speed = np.linalg.norm(residual_acceleration.means_about(record, record.wind, rows), axis=1)
        own += (GUST * speed[:, None]) ** 2 * worst
    return Balance(rows, F, sd_F, own, misfit, full)


def masses(physics: MMG, values: np.ndarray) -> np.ndarray:
    """Mᵀ [3, 3]: force X, Y, N [N, N, N m] that 1 m/s² of surge, of sway and 1 rad/s² take, one a
    row."""
    return body.forces_of(named(physics.names, values), physics.geometry, np.eye(3))


def largest_own_forces(record: Record, physics: MMG, values: np.ndarray) -> np.ndarray:
    """Σ_units max over settings (|X|, |Y|, |N|) [3], N, N and N m: what screws, rudders and
    thrusters could make of a ship at rest.

    Unit by unit, each at its worst for each channel: more than any one setting of all of them.
    """
    g = physics.geometry
    column = _ranges(record)
    units = [
        [s.column, *(b.column for b in g.rudders if b.behind == i)]
        for i, s in enumerate(g.propellers)
    ]
    units += [[t.column, *([] if t.turned_by is None else [t.turned_by])] for t in g.thrusters]
    total = np.zeros(3)
    for unit in units:
        tried = itertools.product(*(column[i] for i in unit))
        settings = np.array(list(tried))
        actuator = np.zeros((len(settings), g.actuators))
        actuator[:, unit] = settings
        parts = _forces(physics, values, np.zeros((len(settings), 6)), actuator)
        own = sum(parts[name] for name in ("propeller", "rudder", "thruster") if name in parts)
        total += np.abs(own).max(0)
    return total


def _forces(
    physics: MMG, values: np.ndarray, state: np.ndarray, actuator: np.ndarray
) -> dict[str, np.ndarray]:
    """Parts of MMG.forces [n, 3] in calm air."""
    with np.errstate(all="ignore"):
        return physics.forces(values, state, actuator, np.zeros((len(state), 2)))


def _ranges(record: Record) -> list[np.ndarray]:
    """Settings to try of each actuator: its stops, or its measured extremes."""
    found = []
    for i, actuator in enumerate(record.profile.actuators):
        far = float(np.abs(record.actuator[:, i]).max(initial=0.0))
        low, high = actuator.si_limits or (-far, far)
        if actuator.kind == "azimuth":
            low, high = -math.pi, math.pi
        drives = actuator.kind in ("propeller", "thruster")
        found.append(np.array([low, high]) if drives else np.linspace(low, high, ANGLES))
    return found


def _resting(record: Record, physics: MMG, rows: np.ndarray) -> np.ndarray:
    """max |n|/n_max ≤ STILL over the JETS_GONE_S before a node [K]: no screw has turned."""
    drives = [u.column for u in (*physics.geometry.propellers, *physics.geometry.thrusters)]
    ranges = _ranges(record)
    most = np.array([np.abs(ranges[i]).max() for i in drives])
    power = (np.abs(record.actuator[:, drives]) / np.maximum(most, 1e-9)).max(1)
    turned = np.concatenate(([0], np.cumsum(power > STILL)))
    before = np.maximum(rows - round(JETS_GONE_S / record.step), record.firsts[rows])
    after = np.minimum(
        rows + round(0.5 * record.timescale.node_step / record.step), record.lasts[rows]
    )
    return turned[after + 1] == turned[before]


def _contradicted(record: Record, rows: np.ndarray) -> np.ndarray:
    """[K] bool: position or heading jumps nearby. A receiver that stood still and caught up
    looks like a ship that was stopped and thrown."""
    sensors = record.profile.sensors
    state, shaken = record.state, np.zeros(len(record), dtype=bool)
    velocity = frames.to_body(state[:, [1, 3]], -state[:, 4])  # and back, to earth axes
    lasts = record.lasts
    for a in np.flatnonzero(record.starts):
        part = slice(a, lasts[a] + 1)
        for gone, rate, noise in (
            (state[part][:, [0, 2]], velocity[part], sensors.noise("position")),
            (state[part, 4, None], state[part, 5, None], sensors.noise("heading")),
        ):
            for row, _ in jumps(gone, rate, record.measured[part], noise):
                shaken[a + row] = True
    near = np.concatenate(([0], np.cumsum(shaken)))
    reach = round(DOUBT / record.step)
    low, high = np.maximum(rows - reach, 0), np.minimum(rows + reach, len(record) - 1)
    return near[high + 1] > near[low]


def _nodes_of(found: Unexplained) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows [K] in order, means and standard deviations [K, 3], each instant once."""
    keep = residual_acceleration.unique_instants(found)
    order = np.argsort(found.rows[keep])
    mean, sd = (np.moveaxis(v, 1, -1)[keep][order] for v in (found.mean, found.sd))
    return found.rows[keep][order], mean, sd


def _unbroken(record: Record, rows: np.ndarray) -> Iterator[slice]:
    """Nodes that follow each other."""
    apart = (np.diff(record.firsts[rows]) != 0) | (
        np.diff(record.time[rows]) > 1.5 * record.timescale.node_step
    )
    ends = [0, *(np.flatnonzero(apart) + 1).tolist(), len(rows)]
    yield from (slice(a, b) for a, b in itertools.pairwise(ends))


def _event(
    record: Record, weighed: Balance, limit: np.ndarray, part: slice, channel: int, first: int,
    last: int,
) -> tuple[float, Stretch]:  # fmt: skip
    """max |F|/limit over the nodes of the part; and the event: nodes first to last, and on to where
    the force has fallen to EDGE of its peak."""
    force, rows = np.abs(weighed.force[part, channel]), weighed.rows[part]
    at = first + int(force[first : last + 1].argmax())
    share, time = force / force[at], record.time[rows]
    low = np.flatnonzero(share[:first] < EDGE)
    high = np.flatnonzero(share[last + 1 :] < EDGE) + last + 1

    def crossing(inside: int, outside: int) -> float:
        """When it passed EDGE; the node inside, where that was beyond the limit but below EDGE."""
        way = (share[inside] - EDGE) / (share[inside] - share[outside])
        return float(time[inside] + max(way, 0.0) * (time[outside] - time[inside]))

    full = float(weighed.full[2 if channel == 2 else 0])
    found = Stretch(
        voyage=record.names[record.voyage[rows[0]]],
        start_s=crossing(low[-1] + 1, low[-1]) if len(low) else float(time[0]),
        end_s=crossing(high[0] - 1, high[0]) if len(high) else float(time[-1]),
        channel=CHANNELS[channel],
        peak=float(weighed.force[part, channel][at]),
        percent=100.0 * float(force[at]) / full if full > 0.0 else math.inf,
    )
    return float((force / limit)[first : last + 1].max()), found


def _merged(events: list[tuple[float, Stretch]], names: tuple[str, ...]) -> Iterator[Stretch]:
    """Over channels and short breaks; what is shorter than SHORTEST_S after all is left out."""
    groups: list[list[tuple[float, Stretch]]] = []
    for event in sorted(events, key=lambda e: (names.index(e[1].voyage), e[1].start_s)):
        last = [e for _, e in groups[-1]] if groups else []
        near = last and last[0].voyage == event[1].voyage
        if near and event[1].start_s - max(e.end_s for e in last) < GAP:
            groups[-1].append(event)
        else:
            groups.append([event])
    for group in groups:
        _, worst = max(group, key=lambda e: e[0])
        start, end = group[0][1].start_s, max(e.end_s for _, e in group)
        if end - start >= SHORTEST_S:
            yield replace(worst, start_s=start, end_s=end)
