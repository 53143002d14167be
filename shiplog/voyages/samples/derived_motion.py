"""Velocities and yaw rate of a ship that only knows where it is and where it points.

The positions of the antenna, along x₀ and y₀ together, and the headings are each smoothed as
`pose_smoother` has it. With V the velocity of the antenna at the lever arm l = (l_x, l_y) and its
standard deviation σ_V along each axis, heading and yaw rate with σ_ψ and σ_r,

    (u, v) = R(-ψ) V - r × l,
    σ_u² = σ_V² + (v σ_ψ)² + (l_y σ_r)²,   σ_v² = σ_V² + (u σ_ψ)² + (l_x σ_r)²

Where the profile states a larger accuracy of the source than its samples scatter by, part of the
error is slow: the deviations are then as much larger. A row between whose neighbours nothing was
measured, or whose velocity is WORST times as uncertain as the median, has none: at the ends of a
record little is known of a velocity. The mean over T = 1 s of a derived velocity is the way gone
over T, so that its standard deviation σ̄ is no more than that of a row, and no more than that of
the difference of two smoothed positions:

    σ̄ = min(σ_V, √2 σ_P/T)

A derived velocity is a function of the positions. A likelihood that has the positions takes it for
no second measurement: `Sensors.derived` names such channels, and no diagnosis counts them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.logs.health.health_report import DerivedChannel
from shiplog.nomenclature import channels, frames
from shiplog.ship_profile.profile import Sensors
from shiplog.voyages.rows import fault_detection, noise_estimate
from shiplog.voyages.rows.pose_smoother import Smoothed, smooth
from shiplog.voyages.rows.resampling import Samples

WORST = 3.0  # times the median standard deviation: a velocity less sure than that is none
ENDLESS = 1e300  # m: a position does not come round as a heading does
USUAL = 0.95  # quantile of the speeds: a ship mostly goes no faster,
UNSEEN = 2.0  # and no more than so many times as far as that while nobody measures
LEAST_STEP_S = 0.04  # s: a ship does nothing faster; the mean of several samples is as good
MEAN_S = 1.0  # s, over which the rows of a window are averaged


@dataclass(frozen=True)
class Rate:
    """Of one source on the grid [m]: the smoothed value, its rate and the standard deviations of
    both, NaN where they are not derived; σ of a sample and √q of the source's smoother."""

    value: np.ndarray
    rate: np.ndarray
    value_deviation: np.ndarray
    rate_deviation: np.ndarray
    sigma: float
    jerk: float


@dataclass(frozen=True)
class DerivedMotion:
    """surge and sway [m, 2] and yaw rate [m] at midship, NaN where they are not derived, and what
    is to be said of them."""

    velocity: np.ndarray
    yaw_rate: np.ndarray
    channels: tuple[DerivedChannel, ...]


def derive(
    times: np.ndarray,
    samples: Mapping[str, Samples],
    datum: tuple[float, float] | None,
    sensors: Sensors,
    measured_rate: np.ndarray | None,
) -> DerivedMotion:
    """At the grid times [m] ns.

    datum          latitude and longitude [deg] of x0 = y0 = 0; None of a local position
    measured_rate  [m] rad/s, where a gyro measures it
    """
    place = samples["position"]
    value = (
        place.value
        if datum is None
        else frames.local_plane(place.value[:, 0], place.value[:, 1], datum)
    )
    position = _rate(
        times, place, value[:, 0] + 1j * value[:, 1], None, sensors.noise("position")
    )  # fmt: skip
    pointing = samples["heading"]
    heading = _rate(
        times, pointing, pointing.value[:, 0], 2.0 * math.pi, sensors.noise("heading")
    )  # fmt: skip
    turning = heading.rate if measured_rate is None else measured_rate
    over_ground = np.stack((np.real(position.rate), np.imag(position.rate)), 1)
    arm = sensors.velocity_arm_m
    velocity = frames.to_body(over_ground, heading.value)
    velocity = frames.velocity_at_midship(velocity, turning, arm)
    of_rate = heading.rate_deviation if measured_rate is None else np.zeros(len(times))
    found = [
        _channel(channels.SURGE, "position", position, velocity[:, 1], heading, arm[1] * of_rate),
        _channel(channels.SWAY, "position", position, velocity[:, 0], heading, arm[0] * of_rate),
    ]
    if measured_rate is None:
        still = np.zeros(len(times))
        found.append(_channel(channels.YAW_RATE, "heading", heading, still, heading, still))
    return DerivedMotion(velocity, turning, tuple(one for one in found if one is not None))


def _rate(
    times: np.ndarray, samples: Samples, value: np.ndarray, period: float | None, stated: float
) -> Rate:
    """Of a source's samples, value [n], complex where it is a position; `period`: a full turn;
    `stated`: its accuracy in the profile, 0 where none is."""
    own = _own(samples)
    kept = replace(samples, time=samples.time[own], value=samples.value[own])
    at, value = kept.time, value[own]
    starts = np.diff(at, prepend=at[:1]) > samples.longest_s * 1e9 if len(at) else own
    for step in torn(kept, value, period):
        starts[step] = True
    if len(starts):
        starts[0] = True
    origin = int(times[0])
    every = max(int(LEAST_STEP_S / samples.period_s), 1)
    seconds, value, starts = _thinned((at - origin) * 1e-9, value, starts, every)
    pieces = smooth(seconds, value, starts)
    return _on_grid((times - origin) * 1e-9, pieces, value.dtype, stated, every)


def _thinned(
    time: np.ndarray, value: np.ndarray, starts: np.ndarray, every: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means of so many samples in a row, of none across the start of a piece."""
    if every == 1 or not len(time):
        return time, value, starts
    edges = np.flatnonzero(starts)
    within = np.arange(len(time)) - np.repeat(edges, np.diff(np.append(edges, len(time))))
    at = np.flatnonzero(within % every == 0)
    count = np.diff(np.append(at, len(time)))
    return np.add.reduceat(time, at) / count, np.add.reduceat(value, at) / count, starts[at]


def _own(samples: Samples) -> np.ndarray:
    """Indices of the samples that the instrument took itself, and no spikes."""
    own = noise_estimate.own_samples(samples.value)
    return own[~samples.spike[own]]


def torn(samples: Samples, value: np.ndarray, period: float | None) -> dict[int, float]:
    """Samples at which a source steps to stay there, and by how much: nothing is smoothed across.
    Not where nothing was measured before one, and the ship can have gone as far meanwhile.

    value   [n], complex where it is a position; `period`: a full turn
    """
    parts = (np.real(value), np.imag(value)) if np.iscomplexobj(value) else (value,)
    found: dict[int, float] = {}
    for part in parts:
        for at, step in fault_detection.steps(part, samples.noise, period or ENDLESS):
            found[at] = math.hypot(found.get(at, 0.0), step)
    if not found:
        return {}
    apart = np.diff(samples.time) * 1e-9
    mostly = float(np.quantile(np.abs(np.diff(value)) / apart, USUAL))
    alone = noise_estimate.WHOLE_PERIODS * samples.period_s
    return {
        at: step for at, step in found.items()
        if apart[at - 1] <= alone or step > UNSEEN * apart[at - 1] * mostly
    }  # fmt: skip


def _on_grid(
    seconds: np.ndarray, pieces: Sequence[Smoothed], dtype: np.dtype, stated: float, every: int
) -> Rate:
    """`every`: samples of which one that was smoothed is the mean."""
    value, rate = (np.full(len(seconds), np.nan, dtype) for _ in range(2))
    of_value, of_rate = np.full(len(seconds), np.nan), np.full(len(seconds), np.nan)
    for piece in pieces:
        inside = (seconds >= piece.time[0]) & (seconds <= piece.time[-1])
        value[inside], rate[inside], of_rate[inside] = piece.at(seconds[inside])
        of_value[inside] = np.interp(seconds[inside], piece.time, piece.deviation[:, 0])
    if pieces:
        unsure = of_rate > WORST * float(np.nanmedian(of_rate))
        rate[unsure], of_rate[unsure] = np.nan, np.nan
    first = pieces[0] if pieces else None
    sigma, jerk = (first.sigma * math.sqrt(every), first.jerk) if first else (0.0, 0.0)
    slower = max(stated / sigma, 1.0) if sigma > 0.0 else 1.0
    return Rate(value, rate, slower * of_value, slower * of_rate, max(sigma, stated), jerk)


def _channel(
    channel: channels.Channel, of: str, source: Rate, across: np.ndarray, heading: Rate,
    by_arm: np.ndarray,
) -> DerivedChannel | None:  # fmt: skip
    """What is to be said of one channel; None where no row of it is derived.

    across  [m] m/s, the other velocity, which an error of the heading turns into this one
    by_arm  [m] m/s, standard deviation of what the yaw rate does at the lever arm
    """
    turned = across * heading.value_deviation
    row = np.sqrt(source.rate_deviation**2 + turned**2 + by_arm**2)
    mean = np.minimum(source.rate_deviation, math.sqrt(2.0) * source.value_deviation / MEAN_S)
    mean = np.sqrt(mean**2 + turned**2 + by_arm**2)
    known = np.isfinite(row)
    if not known.any():
        return None
    size = channel.to_display
    of_source = size if of == "heading" else 1.0  # a position is in m
    return DerivedChannel(
        channel=channel.name,
        of=of,
        sigma=_figures(size * _rms(row[known])),
        sigma_mean=_figures(size * _rms(mean[known])),
        unit=channel.display_unit,
        sample_sigma=_figures(of_source * source.sigma),
        jerk=_figures(of_source * source.jerk),
    )


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _figures(value: float) -> float:
    return float(f"{value:.3g}")
