"""A voyage as the instruments measured it, in bins of one second, and its windows.

An integral over a window is compared with a change over the same window: no noise is amplified,
and a mean of one second at either end is the same linear average on both sides. With the mean p̄_k
of bin k and the integral Q(t) = ∫ V dt,

    y = p̄_{k+T} - p̄_k,     x = Q̄_{k+T} - Q̄_k

Vectors over ground are complex numbers, north + i east, and ψ turns clockwise: R(ψ) is e^{iψ}.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import polars as pl

from shiplog.nomenclature import channels, frames
from shiplog.nomenclature.channels import DEGREE, Quality
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows.resampling import RATE_HZ

STEP_S = 1.0 / RATE_HZ
ROWS = int(RATE_HZ)  # rows of a bin
MEAN = np.full(ROWS, 1.0 / ROWS)
SO_FAR = np.arange(ROWS, 0, -1) / ROWS  # mean over a second of the sum up to each row
LEAST_ROWS = 5  # measured rows of a bin; the others lie on a straight line between measured ones
LEAST_BINS = 0.8  # share of a window's bins
DOUBTFUL = Quality.SPIKE | Quality.FROZEN  # marks of a row that some channel's value is no data
MOST_DOUBTFUL = 0.5  # of the rows: if more are so marked, the mark is what is to be explained
CLIPPED = 0.98  # quantile beyond which a third difference is a jump and no noise


@dataclass(frozen=True)
class Windows:
    """Pairs of bins: first [w], last [w], and the block of time [w] that each one is in."""

    first: np.ndarray
    last: np.ndarray
    block: np.ndarray
    seconds: float

    def change(self, binned: np.ndarray) -> np.ndarray:
        """[B] → [w]."""
        return binned[self.last] - binned[self.first]

    def chosen(self, mask: np.ndarray) -> Windows:
        return Windows(self.first[mask], self.last[mask], self.block[mask], self.seconds)


@dataclass(frozen=True)
class Track:
    """Rows [n] at 10 Hz, gaps bridged; which of them are measured.

    heading   [n] rad, wrapped as measured    yaw_rate  [n] rad/s
    position  [n] complex m, of the antenna   velocity  [n] complex m/s: over ground as measured,
    or ahead + i starboard where the instrument measures in body axes (`body`)
    arm       complex m: from the place of the velocity to that of the position, body axes
    derived   whether the velocity is the position's own change
    """

    profile: Profile
    measured: np.ndarray
    jump: np.ndarray
    heading: np.ndarray
    yaw_rate: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    body: bool
    arm: complex
    driven: dict[str, np.ndarray]  # actuators [n], SI
    derived: bool = False

    @property
    def bins(self) -> int:
        return len(self.heading) // ROWS

    def binned(self, rows: np.ndarray) -> np.ndarray:
        """[n] → the mean of each second [B]."""
        return rows[: self.bins * ROWS].reshape(-1, ROWS) @ MEAN

    def integral(self, rate: np.ndarray) -> np.ndarray:
        """[n] → the mean of its integral over each second [B], by the trapezoidal rule.

        The integral at row j is Δt (Σ_{i≤j} r_i - (r_0 + r_j)/2); of its mean over a second, the
        sum up to that second is one number, and the rest a weighted sum of the second's rows."""
        seconds = rate[: self.bins * ROWS].reshape(-1, ROWS)
        sums, inside = (seconds @ np.stack((np.ones(ROWS), SO_FAR - 0.5 * MEAN), axis=1)).T
        before = np.cumsum(sums) - sums
        return STEP_S * (before + inside - 0.5 * rate[0])

    @cached_property
    def usable(self) -> np.ndarray:
        """[B] bool."""
        return self.binned(self.measured.astype(float)) * ROWS >= LEAST_ROWS

    @cached_property
    def ahead(self) -> np.ndarray:
        """e^{iψ} [n]."""
        return np.cos(self.heading) + 1j * np.sin(self.heading)

    @cached_property
    def bow(self) -> np.ndarray:
        """e^{iψ} [B]."""
        return self.binned(self.ahead)

    @cached_property
    def turned(self) -> np.ndarray:
        """Heading [B], unwrapped from row to row, rad."""
        return self.binned(np.unwrap(self.heading))

    @cached_property
    def turned_by_rate(self) -> np.ndarray:
        """Integral of the yaw rate [B], rad."""
        return self.integral(self.yaw_rate)

    @cached_property
    def place(self) -> np.ndarray:
        """Position [B] of the point whose velocity is measured, m."""
        if self.arm == 0:
            return self.binned(self.position)
        return self.binned(self.position - self.arm * self.ahead)

    @cached_property
    def over_ground(self) -> np.ndarray:
        """Velocity over ground [n]; of body axes, by the heading as it is."""
        return self.velocity * self.ahead if self.body else self.velocity

    @cached_property
    def sailed(self) -> np.ndarray:
        """Integral of the velocity over ground [B], m."""
        return self.integral(self.over_ground)

    @cached_property
    def _so_far(self) -> tuple[np.ndarray, np.ndarray]:
        """Usable bins, and bins with a jump, before each bin [B + 1]."""
        jumps = self.binned(self.jump.astype(float)) > 0.0
        usable, jumped = (np.concatenate(([0], np.cumsum(one))) for one in (self.usable, jumps))
        return usable, jumped

    def windows(self, seconds: int) -> Windows:
        """One after another, `seconds` long, without a jump and nearly whole."""
        first = np.arange(0, self.bins - seconds, seconds)
        last = first + seconds
        known, jumped = self._so_far
        good = self.usable[first] & self.usable[last]
        good &= known[last + 1] - known[first] >= LEAST_BINS * (seconds + 1)
        good &= jumped[last + 1] == jumped[first + 1]
        return Windows(first[good], last[good], np.arange(len(first))[good], float(seconds))


def noise(binned: np.ndarray, usable: np.ndarray) -> float:
    """Standard deviation of the noise of a channel [B] that moves smoothly, of each component.

    From third differences, (1, -3, 3, -1) with a sum of squares of 20, without the largest: those
    are jumps. Coarse steps count as noise.
    """
    third = np.diff(binned, 3)
    whole = usable[:-3] & usable[1:-2] & usable[2:-1] & usable[3:]
    size = np.abs(third[whole])
    if len(size) < 8:
        return 0.0
    size = np.minimum(size, np.quantile(size, CLIPPED))
    components = 2.0 if np.iscomplexobj(binned) else 1.0
    return float(np.sqrt(np.mean(size**2) / 20.0 / components))


def track(table: pl.DataFrame, profile: Profile) -> Track | None:
    """A voyage's 10 Hz table, ingest's way to midship undone; None where nothing was measured."""
    columns = {
        name: table[name].cast(pl.Float64).fill_null(np.nan).to_numpy()
        for name in (*(c.name for c in channels.STATE), *profile.actuator_names)
    }
    mark = table["quality"].to_numpy()
    measured = np.ones(len(mark), bool)
    for c in channels.STATE:
        measured &= np.isfinite(columns[c.name])
    doubtful = (mark & int(DOUBTFUL)) != 0
    if (measured & ~doubtful).sum() > (1.0 - MOST_DOUBTFUL) * measured.sum():
        measured &= ~doubtful
    rows = np.flatnonzero(measured)
    if len(rows) < 2 * ROWS:
        return None
    heading = columns["heading"]
    ahead = np.cos(heading) + 1j * np.sin(heading)
    of_position, of_velocity = (
        complex(*arm)
        for arm in (profile.sensors.position.lever_arm_m, profile.sensors.velocity_arm_m)
    )
    position = columns["x0"] + 1j * columns["y0"]
    velocity = columns["surge"] + 1j * columns["sway"] + 1j * columns["yaw_rate"] * of_velocity
    if of_position != 0:
        position = position + of_position * ahead
    body = profile.sensors.kind("velocity") == "body"
    if not body:
        velocity = velocity * ahead
    position = position - position[rows[0]]
    whole = len(rows) == len(mark)
    at = np.arange(len(mark))

    def bridged(values: np.ndarray) -> np.ndarray:
        return values if whole else np.interp(at, rows, values[rows])

    unwrapped = heading
    if not whole:
        unwrapped = frames.wrap(np.interp(at, rows, np.unwrap(heading[rows])))
    return Track(
        profile=profile, measured=measured, jump=(mark & int(Quality.JUMP)) != 0,
        heading=unwrapped, yaw_rate=bridged(columns["yaw_rate"]),
        position=bridged(position), velocity=bridged(velocity),
        body=body, arm=of_position - of_velocity,
        driven={name: columns[name] for name in profile.actuator_names},
        derived=profile.sensors.velocity is None,
    )  # fmt: skip


def degrees(angle: float) -> float:
    """rad → deg."""
    return angle / DEGREE
