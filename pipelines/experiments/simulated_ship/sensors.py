"""What the instruments make of a voyage: their places, rates, clocks, noise and resolution.

Errors are of the size that the paper's instruments have: GNSS 0.02 m and 0.01 m/s, gyro 0.1 deg
and 0.1 deg/s, anemometer 0.1 m/s and 2 deg. Part of each is slow (an Ornstein-Uhlenbeck process):
averaging does not remove all of it, as it does not in life. Steps of resolution are powers of two,
as those of a converter are.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from pipelines.experiments.simulated_ship.ship import ANTENNA
from pipelines.experiments.simulated_ship.voyage import Voyage
from pipelines.experiments.simulated_ship.weather import ornstein_uhlenbeck
from shiplog.logs.conversion.write import Series, write_log

ORIGIN = "pipelines.known_ship"  # this simulator, as the committed logs name it
DATUM = (34.82, 135.52)  # deg, near Inukai Pond, Osaka University
MILLISECOND = 1_000_000  # ns
COLOUR_TIMES = (1.0, 5.0)  # s, within which coloured noise fades
TICK = (
    2**20
)  # ns, of the recorder's and the sensors' clocks; round in binary, so that zstd packs it
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class Instrument:
    """Rate, clock and way to the recorder of one instrument."""

    name: str
    rate: float  # Hz
    phase: float  # s, of its first sample
    drift: float = 0.0  # 1, its period over the nominal one, less one
    jitter: float = 0.0  # s, standard deviation of its sampling
    latency: float = 0.010  # s, from measurement to the recorder, at least
    queue: float = 0.004  # s, mean of what comes on top


GNSS = Instrument("gnss", 10.0, phase=0.040, latency=0.025, queue=0.003)  # on whole UTC, no jitter
GNSS_VELOCITY = Instrument("gnss_velocity", 10.0, phase=0.040, latency=0.028, queue=0.003)
GYRO = Instrument("gyro", 10.0, phase=0.013, drift=35e-6, jitter=0.001, latency=0.006)
ANEMOMETER = Instrument("anemometer", 4.0, phase=0.110, drift=-60e-6, jitter=0.002, latency=0.018)
PORT = Instrument("rudder_port", 10.0, phase=0.022, drift=12e-6, jitter=0.001, latency=0.005)
STARBOARD = Instrument("rudder_starboard", 10.0, phase=0.027, drift=12e-6, jitter=0.001)
SHAFT = Instrument("propeller", 5.0, phase=0.061, drift=-20e-6, jitter=0.001, latency=0.008)


@dataclass(frozen=True, slots=True)
class Blemishes:
    """Faults of a real day, GNSS only. Times are seconds from the start of the voyage."""

    dropouts: tuple[tuple[float, float], ...] = ()  # start, length: neither position nor velocity
    spikes: tuple[tuple[float, float, float], ...] = ()  # time, metres north, metres east


def write_voyage(
    path: str | os.PathLike[str],
    voyage: Voyage,
    *,
    seed: int,
    start: datetime,
    blemishes: Blemishes | None = None,
) -> None:
    """Measure the voyage and write it as a log of the contract.

    seed     of all instruments' noise and clocks, apart from the seed of the voyage itself
    start    of the voyage, with a time zone
    """
    series = measure(voyage, seed=seed, start=start, blemishes=blemishes or Blemishes())
    write_log(
        path,
        series,
        ship=voyage.ship.name,
        datum=DATUM,
        notes={"origin": ORIGIN},
    )


def measure(voyage: Voyage, *, seed: int, start: datetime, blemishes: Blemishes) -> list[Series]:
    """Every topic of the log, in the order in which a reader meets them."""
    zero = (start - EPOCH) // timedelta(microseconds=1) * 1000
    sight = _Sight(voyage, seed, zero)
    return [
        _fix(sight, blemishes),
        _velocity(sight, blemishes),
        _gyro(sight),
        _wind(sight),
        _actuator(sight, PORT, "/rudder/port", "shiplog.Rudder"),
        _actuator(sight, STARBOARD, "/rudder/starboard", "shiplog.Rudder"),
        _actuator(sight, SHAFT, "/propeller/main", "shiplog.Propeller"),
    ]


class _Sight:
    """The voyage as instruments meet it: true columns at any time, and streams of noise."""

    def __init__(self, voyage: Voyage, seed: int, zero: int) -> None:
        self.voyage, self.effects = voyage, voyage.effects
        self.seed, self.zero = seed, zero

    def stream(self, purpose: str) -> np.random.Generator:
        """One stream a purpose: more noise here must not change the noise there."""
        return np.random.default_rng([self.seed, *purpose.encode()])

    def samples(self, instrument: Instrument) -> np.ndarray:
        """[N] seconds into the voyage at which the instrument measures, whole milliseconds."""
        period = (1.0 + instrument.drift) / instrument.rate
        count = int((self.voyage.duration - instrument.phase) / period) + 1
        times = instrument.phase + period * np.arange(count)
        times += instrument.jitter * self.stream(f"{instrument.name} jitter").standard_normal(count)
        return np.round(np.clip(times, 0.0, self.voyage.duration), 3)

    def true(self, name: str, times: np.ndarray, channel: str = "") -> np.ndarray:
        """A true column at `times`, or earlier where the channel's clock is late."""
        clocks = self.effects.clock_offset
        late = clocks.get(channel, 0.0)
        if channel in ("position", "velocity"):
            late += clocks.get("gnss", 0.0)
        return np.interp(times - late, self.voyage.time, getattr(self.voyage, name))

    def noise(self, name: str, times: np.ndarray, sigma: float, slow: float, memory: float):
        """[N] of standard deviation `sigma`; the share `slow` of its variance lasts `memory` s."""
        rng = self.stream(f"{name} noise")
        step = float(np.mean(np.diff(times))) if len(times) > 1 else 1.0
        drifting = ornstein_uhlenbeck(rng, len(times), step, memory, sigma * np.sqrt(slow))
        quick = rng.standard_normal(len(times))
        share = self.effects.coloured
        if share > 0.0:
            rng = self.stream(f"{name} colour")
            fades = rng.uniform(*COLOUR_TIMES)
            colour = ornstein_uhlenbeck(rng, len(times), step, fades, np.sqrt(share))
            quick = np.sqrt(1.0 - share) * quick + colour
        return drifting + sigma * np.sqrt(1.0 - slow) * quick

    def _misstamped(self, instrument: Instrument, count: int) -> np.ndarray:
        """[N] ns between the instant measured and its stamp; too little to change their order."""
        jitter = self.effects.clock_jitter
        if jitter == 0.0:
            return np.zeros(count, np.int64)
        off = jitter * self.stream(f"{instrument.name} stamp").standard_normal(count)
        off = np.clip(off, -0.45 / instrument.rate, 0.45 / instrument.rate)
        return np.round(off * 1e3).astype(np.int64) * MILLISECOND

    def series(
        self,
        instrument: Instrument,
        topic: str,
        schema: str,
        times: np.ndarray,
        columns: dict[str, np.ndarray],
        **metadata: str,
    ) -> Series:
        """Stamp the samples: measurement, the sensor's own clock, and arrival at the recorder."""
        stamp = self.zero + np.round(times * 1e3).astype(np.int64) * MILLISECOND
        queue = self.stream(f"{instrument.name} queue").exponential(instrument.queue, len(times))
        arrival = stamp + ((instrument.latency + np.minimum(queue, 0.012)) * 1e9).astype(np.int64)
        stamp = stamp + self._misstamped(instrument, len(times))
        return Series(
            topic, schema, stamp, columns,
            log_time=arrival // TICK * TICK, publish_time=stamp // TICK * TICK,
            metadata={**metadata, "nominal_hz": f"{instrument.rate:g}"},
        )  # fmt: skip


def _resolved(values: np.ndarray, bits: int) -> np.ndarray:
    """To steps of 2^-bits. Plus zero: an instrument knows no minus zero."""
    return np.round(values * 2.0**bits) * 2.0**-bits + 0.0


def _compass(angle_rad: np.ndarray, bits: int) -> np.ndarray:
    """In [0, 360) deg; what rounds up to 360 is north."""
    return _resolved(np.rad2deg(angle_rad) % 360.0, bits) % 360.0


def _mounted(sight: _Sight) -> tuple[float, float]:
    """Where the antenna really is [m]; the profile says `ANTENNA`."""
    ahead, aside = sight.effects.antenna_offset
    return ANTENNA[0] + ahead, ANTENNA[1] + aside


def _whole(times: np.ndarray, blemishes: Blemishes) -> np.ndarray:
    keep = np.ones(len(times), bool)
    for begin, length in blemishes.dropouts:
        keep &= (times < begin) | (times >= begin + length)
    return keep


def _fix(sight: _Sight, blemishes: Blemishes) -> Series:
    times = sight.samples(GNSS)

    def seen(name: str) -> np.ndarray:
        return sight.true(name, times, "position")

    ahead, aside = _mounted(sight)
    cos, sin = np.cos(seen("heading")), np.sin(seen("heading"))
    north = seen("x0") + ahead * cos - aside * sin + sight.noise("north", times, 0.02, 0.5, 40.0)
    east = seen("y0") + ahead * sin + aside * cos + sight.noise("east", times, 0.02, 0.5, 40.0)
    for at, far_north, far_east in blemishes.spikes:
        north[np.argmin(np.abs(times - at))] += far_north
        east[np.argmin(np.abs(times - at))] += far_east
    latitude, longitude = geodetic(north, east)
    columns = {"latitude": _resolved(latitude, 27), "longitude": _resolved(longitude, 27)}
    keep = _whole(times, blemishes)
    return sight.series(
        GNSS, "/gnss/fix", "foxglove.LocationFix", times[keep],
        {name: values[keep] for name, values in columns.items()},
        unit="deg", sensor="RTK GNSS", sigma_m="0.02",
    )  # fmt: skip


def _velocity(sight: _Sight, blemishes: Blemishes) -> Series:
    times = sight.samples(GNSS_VELOCITY)

    def seen(name: str) -> np.ndarray:
        return sight.true(name, times, "velocity")

    ahead, aside = _mounted(sight)
    surge = seen("surge") - seen("yaw_rate") * aside  # at the antenna
    sway = seen("sway") + seen("yaw_rate") * ahead
    cos, sin = np.cos(seen("heading")), np.sin(seen("heading"))
    north = surge * cos - sway * sin + sight.noise("v north", times, 0.01, 0.2, 5.0)
    east = surge * sin + sway * cos + sight.noise("v east", times, 0.01, 0.2, 5.0)
    columns = {
        "sog_mps": _resolved(np.hypot(north, east), 10),
        "cog_deg": _compass(np.arctan2(east, north), 7),
    }
    keep = _whole(times, blemishes)
    return sight.series(
        GNSS_VELOCITY, "/gnss/velocity", "shiplog.GnssVelocity", times[keep],
        {name: values[keep] for name, values in columns.items()},
        unit="m/s, deg", sign="true, clockwise from north", sensor="RTK GNSS",
    )  # fmt: skip


def _gyro(sight: _Sight) -> Series:
    times, effects = sight.samples(GYRO), sight.effects
    degree = np.deg2rad(1.0)
    heading = sight.true("heading", times) + effects.heading_offset
    heading = heading + sight.noise("heading", times, 0.1 * degree, 0.3, 30.0)
    rate = (1.0 + effects.yaw_rate_scale) * sight.true("yaw_rate", times, "yaw_rate")
    rate = rate + effects.yaw_rate_bias + sight.noise("rate", times, 0.1 * degree, 0.1, 10.0)
    columns = {
        "heading_deg": _compass(heading, 7),
        "yaw_rate_degps": _resolved(np.rad2deg(rate), 7),
    }
    return sight.series(
        GYRO, "/gyro", "shiplog.Gyro", times, columns,
        unit="deg, deg/s", sign="clockwise from north; bow to starboard", sensor="fibre-optic gyro",
    )  # fmt: skip


def _wind(sight: _Sight) -> Series:
    """Apparent wind at midship; a lull gives no direction, so the vector carries the noise."""
    times, effects = sight.samples(ANEMOMETER), sight.effects
    speed = sight.true("wind_speed", times, "wind")
    vector = sight.voyage.wind_speed * np.exp(1j * sight.voyage.wind_angle)
    late = effects.clock_offset.get("wind", 0.0)
    angle = np.angle(np.interp(times - late, sight.voyage.time, vector))
    angle = angle + effects.wind_direction_offset
    angle = angle + sight.noise("wind angle", times, np.deg2rad(2.0), 0.3, 20.0)
    speed = (1.0 + effects.wind_speed_scale) * speed
    speed = np.maximum(speed + sight.noise("wind speed", times, 0.1, 0.3, 20.0), 0.0)
    columns = {"speed_mps": _resolved(speed, 6), "direction_deg": _compass(angle, 3)}
    return sight.series(
        ANEMOMETER, "/wind/apparent", "shiplog.Wind", times, columns,
        unit="m/s, deg", sign="blowing from, clockwise from the bow", sensor="ultrasonic",
    )  # fmt: skip


def _actuator(sight: _Sight, instrument: Instrument, topic: str, schema: str) -> Series:
    times = sight.samples(instrument)
    true = sight.true(instrument.name, times)
    if schema == "shiplog.Rudder":
        return sight.series(
            instrument, topic, schema, times, {"angle_deg": _resolved(np.rad2deg(true), 4)},
            unit="deg", sign="positive turns the bow to starboard", sensor="stock encoder",
        )  # fmt: skip
    return sight.series(
        instrument, topic, schema, times, {"speed_rps": _resolved(true, 6)},
        unit="rps", sign="positive drives ahead", sensor="shaft encoder",
    )  # fmt: skip


def geodetic(north: np.ndarray, east: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Latitude and longitude [deg] of points [m] in the plane that touches WGS 84 at `DATUM`."""
    a, flattening = 6378137.0, 1.0 / 298.257223563
    e2 = flattening * (2.0 - flattening)
    lat, lon = np.deg2rad(DATUM)
    sin, cos = np.sin(lat), np.cos(lat)
    normal = a / np.sqrt(1.0 - e2 * sin**2)
    # earth-centred, turned about the axis so that the datum's meridian is the x axis
    x = normal * cos - sin * north
    z = normal * (1.0 - e2) * sin + cos * north
    across = np.hypot(x, east)
    latitude = np.full(np.shape(across), lat)
    for _ in range(4):  # contracts by e² each time: 1e-12 rad from 50 m
        n = a / np.sqrt(1.0 - e2 * np.sin(latitude) ** 2)
        latitude = np.arctan2(z + e2 * n * np.sin(latitude), across)
    return np.rad2deg(latitude), np.rad2deg(lon + np.arctan2(east, x))
