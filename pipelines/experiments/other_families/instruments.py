"""What the instruments make of a voyage: places, rates, clocks, noise, resolution; MCAP logs.

Noise is white plus a slow part made of sines over half a minute to some minutes. Every instrument
has a clock and a way to the recorder of its own.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from pipelines.experiments.other_families.disturbance import sines
from pipelines.experiments.other_families.ship import Actuator
from pipelines.experiments.other_families.voyage import Voyage
from shiplog.logs.conversion.write import Series, write_log

DATUM = (63.44, 10.40)  # deg, near the harbour of Trondheim
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
MILLISECOND, TICK = 1_000_000, 2**20  # ns
RATE, WIND_RATE = 10.0, 5.0  # Hz
SLOW_BAND = (0.004, 0.03)  # Hz, of slow noise
SCHEMAS = {  # the contract's, and two plain ones that a user's logger might write
    "local": "harbour.LocalPosition", "ned": "harbour.EarthVelocity",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Clock:
    """phase [s] of the first sample, drift [1], jitter [s], latency and mean queue [s]."""

    phase: float
    drift: float
    jitter: float
    latency: float
    queue: float


def write_voyage(
    path: str | os.PathLike[str], voyage: Voyage, *, seed: int, start: datetime
) -> None:
    """Measure the voyage and write it as a log. `start` has a time zone."""
    write_log(
        path, measure(voyage, seed=seed, start=start), ship=voyage.ship.name, datum=DATUM,
        notes={"origin": "simulated"},
    )  # fmt: skip


def measure(voyage: Voyage, *, seed: int, start: datetime) -> list[Series]:
    """Every topic of the log."""
    bridge = Bridge(voyage, seed, (start - EPOCH) // timedelta(microseconds=1) * 1000)
    series = [bridge.position(), bridge.velocity(), bridge.gyro()]
    if voyage.ship.winds:
        series.append(bridge.wind())
    for column, actuator in enumerate(voyage.ship.actuators):
        series.append(bridge.actuator(bridge.recorded(column), actuator))
    if voyage.effects.feedback:
        series.append(bridge.feedback(*voyage.effects.feedback))
    return series


def topic(actuator: Actuator) -> tuple[str, str, str]:
    """Topic, schema and field of an actuator's record."""
    if actuator.kind == "rudder":
        return f"/rudder/{actuator.name}", "shiplog.Rudder", "angle_deg"
    if actuator.kind == "azimuth":
        return f"/azimuth/{actuator.name}", "shiplog.Azimuth", "angle_deg"
    return f"/propeller/{actuator.name}", "shiplog.Propeller", "speed_rps"


class Bridge:
    """The voyage as instruments meet it: true columns at any time, and streams of noise."""

    def __init__(self, voyage: Voyage, seed: int, zero: int) -> None:
        self.voyage, self.effects, self.ship = voyage, voyage.effects, voyage.ship
        self.seed, self.zero = seed, zero

    def stream(self, purpose: str) -> np.random.Generator:
        return np.random.default_rng([self.seed, *purpose.encode()])

    def clock(self, name: str) -> Clock:
        rng = self.stream(f"{name} clock")
        return Clock(
            rng.uniform(0.0, 0.09), rng.normal(0.0, 3e-5), rng.uniform(0.0, 0.002),
            rng.uniform(0.004, 0.03), rng.uniform(0.002, 0.006),
        )  # fmt: skip

    def samples(self, name: str, rate: float) -> np.ndarray:
        """[N] s into the voyage at which the instrument measures, whole milliseconds."""
        clock = self.clock(name)
        period = (1.0 + clock.drift) / rate
        times = clock.phase + period * np.arange(
            int((self.voyage.duration - clock.phase) / period) + 1
        )
        times += clock.jitter * self.stream(f"{name} jitter").standard_normal(len(times))
        return np.round(np.clip(times, 0.0, self.voyage.duration), 3)

    def late(self, channel: str) -> float:
        """s by which a channel's clock is late."""
        clocks: Mapping[str, float] = self.effects.clock_offset
        gnss = clocks.get("gnss", 0.0) if channel in ("position", "velocity") else 0.0
        return clocks.get(channel, 0.0) + gnss

    def true(self, values: np.ndarray, times: np.ndarray, channel: str = "") -> np.ndarray:
        return np.interp(times - self.late(channel), self.voyage.time, values)

    def noise(self, name: str, times: np.ndarray, sigma: float) -> np.ndarray:
        rng, slow = self.stream(f"{name} noise"), self.ship.sensors.slow
        white = rng.standard_normal(len(times))
        drift = sines(rng, times, *SLOW_BAND, lambda f: 1.0 / f)
        return sigma * (math.sqrt(1.0 - slow) * white + math.sqrt(slow) * drift)

    def series(
        self, name: str, topic: str, schema: str, times: np.ndarray,
        columns: dict[str, np.ndarray], rate: float, **metadata: str,
    ) -> Series:  # fmt: skip
        """Stamp the samples: measurement, the sensor's own clock, arrival at the recorder."""
        clock = self.clock(name)
        stamp = self.zero + np.round(times * 1e3).astype(np.int64) * MILLISECOND
        queue = self.stream(f"{name} queue").exponential(clock.queue, len(times))
        arrival = stamp + ((clock.latency + np.minimum(queue, 0.02)) * 1e9).astype(np.int64)
        return Series(
            topic, schema, stamp, columns, log_time=arrival // TICK * TICK,
            publish_time=stamp // TICK * TICK, metadata={**metadata, "nominal_hz": f"{rate:g}"},
        )  # fmt: skip

    def _antenna(self) -> tuple[float, float]:
        """m, where it really is; the profile has `Sensors.antenna`."""
        ahead, aside = self.effects.antenna_offset
        return self.ship.sensors.antenna[0] + ahead, self.ship.sensors.antenna[1] + aside

    def position(self) -> Series:
        sensors, v = self.ship.sensors, self.voyage
        times = self.samples("position", RATE)
        psi = self.true(v.heading, times, "position")
        ahead, aside = self._antenna()
        north = self.true(v.x0, times, "position") + ahead * np.cos(psi) - aside * np.sin(psi)
        east = self.true(v.y0, times, "position") + ahead * np.sin(psi) + aside * np.cos(psi)
        north += self.noise("north", times, sensors.position_sigma)
        east += self.noise("east", times, sensors.position_sigma)
        if sensors.position == "local":
            columns = {"x_m": resolved(north, 10), "y_m": resolved(east, 10)}
            return self.series(
                "position", "/gnss/local", SCHEMAS["local"], times, columns, RATE, unit="m"
            )
        latitude, longitude = geodetic(north, east)
        columns = {"latitude": resolved(latitude, 27), "longitude": resolved(longitude, 27)}
        return self.series(
            "position", "/gnss/fix", "foxglove.LocationFix", times, columns, RATE, unit="deg"
        )

    def velocity(self) -> Series:
        sensors, v = self.ship.sensors, self.voyage
        times = self.samples("velocity", RATE)

        def true(values: np.ndarray) -> np.ndarray:
            return self.true(values, times, "velocity")

        ahead, aside = self._antenna()
        psi, rate = true(v.heading), true(v.yaw_rate)
        moved = (true(v.surge) - rate * aside + 1j * (true(v.sway) + rate * ahead)) * np.exp(
            1j * psi
        )
        north = moved.real + self.noise("v north", times, sensors.velocity_sigma)
        east = moved.imag + self.noise("v east", times, sensors.velocity_sigma)
        if sensors.velocity == "ned":
            columns = {"north_mps": resolved(north, 10), "east_mps": resolved(east, 10)}
            return self.series(
                "velocity", "/gnss/earth_velocity", SCHEMAS["ned"], times, columns, RATE,
                unit="m/s",
            )  # fmt: skip
        columns = {
            "sog_mps": resolved(np.hypot(north, east), 10),
            "cog_deg": compass(np.arctan2(east, north), 7),
        }
        return self.series(
            "velocity", "/gnss/velocity", "shiplog.GnssVelocity", times, columns, RATE,
            unit="m/s, deg", sign="true, clockwise from north",
        )  # fmt: skip

    def gyro(self) -> Series:
        sensors, v, e = self.ship.sensors, self.voyage, self.effects
        times = self.samples("gyro", RATE)
        heading = self.true(v.heading, times) + e.heading_offset
        heading = heading + self.noise("heading", times, sensors.heading_sigma)
        rate = (1.0 + e.yaw_rate_scale) * self.true(v.yaw_rate, times, "yaw_rate")
        rate = rate + e.yaw_rate_bias + self.noise("rate", times, sensors.rate_sigma)
        columns = {
            "heading_deg": compass(heading, 7), "yaw_rate_degps": resolved(np.rad2deg(rate), 10)
        }  # fmt: skip
        return self.series(
            "gyro", "/gyro", "shiplog.Gyro", times, columns, RATE, unit="deg, deg/s",
            sign="clockwise from north; bow to starboard",
        )  # fmt: skip

    def wind(self) -> Series:
        """Apparent wind at midship. The vector carries the clock, speed and angle the noise."""
        sensors, v, e = self.ship.sensors, self.voyage, self.effects
        times = self.samples("wind", WIND_RATE)
        vector = self.true(v.from_ahead, times, "wind") + 1j * self.true(
            v.from_starboard, times, "wind"
        )
        angle = np.angle(vector) + e.wind_direction_offset
        angle = angle + self.noise("wind angle", times, sensors.wind_sigma[1])
        speed = (1.0 + e.wind_speed_scale) * np.abs(vector)
        speed = np.maximum(speed + self.noise("wind speed", times, sensors.wind_sigma[0]), 0.0)
        columns = {"speed_mps": resolved(speed, 6), "direction_deg": compass(angle, 3)}
        return self.series(
            "wind", "/wind/apparent", "shiplog.Wind", times, columns, WIND_RATE, unit="m/s, deg",
            sign="blowing from, clockwise from the bow",
        )  # fmt: skip

    def recorded(self, column: int) -> int:
        """The unit whose values this column has: two may be exchanged."""
        two = self.effects.exchanged or ()
        return two[1 - two.index(column)] if column in two else column

    def feedback(self, unit: int, off: float) -> Series:
        """What a feedback that is off says of a unit, next to its order; no profile has it yet."""
        one = self.ship.actuators[unit]
        where, schema, name = topic(one)
        times = self.samples(f"{one.name} feedback", RATE)
        shown = np.rad2deg(self.true(self.voyage.actuators[:, unit], times) + off)
        return self.series(
            f"{one.name} feedback", f"{where}_feedback", schema, times,
            {name: resolved(shown, 4)}, RATE, unit="deg",
        )  # fmt: skip

    def actuator(self, column: int, actuator: Actuator) -> Series:
        times = self.samples(actuator.name, RATE)
        true = self.true(self.voyage.actuators[:, column], times)
        where, schema, name = topic(actuator)
        if name == "speed_rps":
            values, unit = resolved(true, 8), "rps"
        elif actuator.kind == "azimuth":
            values, unit = resolved((np.rad2deg(true) + 180.0) % 360.0 - 180.0, 4), "deg"
        else:
            values, unit = resolved(np.rad2deg(true), 4), "deg"
        return self.series(actuator.name, where, schema, times, {name: values}, RATE, unit=unit)


def resolved(values: np.ndarray, bits: int) -> np.ndarray:
    """To steps of 2^-bits. Plus zero: an instrument knows no minus zero."""
    return np.round(values * 2.0**bits) * 2.0**-bits + 0.0


def compass(angle: np.ndarray, bits: int) -> np.ndarray:
    """In [0, 360) deg; what rounds up to 360 is north."""
    return resolved(np.rad2deg(angle) % 360.0, bits) % 360.0


def geodetic(north: np.ndarray, east: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Latitude, longitude [deg] of points [m] in the plane that touches WGS 84 at `DATUM`.

    Straight through earth-centred coordinates; latitude by Bowring's (1976) formula, exact to
    1e-9 m at the surface.
    """
    a, f = 6378137.0, 1.0 / 298.257223563
    b, e2 = a * (1.0 - f), f * (2.0 - f)
    lat, lon = np.deg2rad(DATUM)
    sin, cos = math.sin(lat), math.cos(lat)
    normal = a / math.sqrt(1.0 - e2 * sin * sin)
    outward = normal * cos - sin * north  # in the datum's meridian plane
    up = normal * (1.0 - e2) * sin + cos * north
    p = np.hypot(outward, east)
    theta = np.arctan2(up * a, p * b)
    ep2 = e2 / (1.0 - e2)
    latitude = np.arctan2(up + ep2 * b * np.sin(theta) ** 3, p - e2 * a * np.cos(theta) ** 3)
    return np.rad2deg(latitude), np.rad2deg(lon + np.arctan2(east, outward))
