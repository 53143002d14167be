"""A voyage in closed form, a circle at constant speed: its profile, its log, and a comparison."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.commands.convert import convert
from shiplog.logs.conversion.write import Series, write_log
from shiplog.ship_profile import file as profiles
from shiplog.voyages.ingest.ingest import ingest

START = 1_617_969_600.0  # 2021-04-09 12:00:00 UTC
SPEED, RATE, RADIUS_M = 2.0, 0.02, 100.0  # m/s, rad/s: half a circle and more in 200 s
SECONDS, HZ = 60.0, 10.0
LATITUDE, LONGITUDE = 56.04, 12.65  # of the circle's centre
M_PER_LATITUDE = 111_350.0  # any smooth map to degrees will do: all layouts hold the same degrees
M_PER_LONGITUDE = 62_300.0


class Voyage:
    """The circle at 10 Hz, drifting by 0.1 rad: heading and course differ."""

    def __init__(self, hz: float = HZ, start: float = START) -> None:
        self.t = np.arange(round(SECONDS * hz) + 1) / hz
        self.unix = start + self.t
        self.ns = np.round(self.t * 1e9).astype(np.int64) + int(start) * 1_000_000_000
        self.course = (5.6 + RATE * self.t) % (2 * np.pi)  # rad, passes north after 34 s
        self.heading = (self.course - 0.1) % (2 * np.pi)
        self.north = RADIUS_M * np.sin(self.course)
        self.east = -RADIUS_M * np.cos(self.course)
        self.latitude = LATITUDE + self.north / M_PER_LATITUDE
        self.longitude = LONGITUDE + self.east / M_PER_LONGITUDE
        self.rudder = 10.0 * np.sin(0.1 * self.t)  # deg
        self.rps = 8.0 + 0.5 * np.sin(0.05 * self.t)
        self.wind_speed = 5.0 + np.sin(0.03 * self.t)  # m/s
        self.wind_angle = (40.0 + 10 * np.sin(0.04 * self.t)) % 360  # deg, from the bow

    @property
    def course_deg(self):
        return np.degrees(self.course)

    @property
    def heading_deg(self):
        return np.degrees(self.heading)

    @property
    def velocity(self):
        """North and east, m/s."""
        return SPEED * np.cos(self.course), SPEED * np.sin(self.course)


SENSORS = {
    "position": """[sensors.position]
kind = "geodetic"
topic = "/gnss/fix"
fields = ["latitude", "longitude"]
unit = "deg"
""",
    "local": """[sensors.position]
kind = "local"
topic = "/ship/state"
fields = ["x0_m", "y0_m"]
unit = "m"
""",
    "sog_cog": """[sensors.velocity]
topic = "/gnss/velocity"
fields = ["sog_mps", "cog_deg"]
units = ["m/s", "deg"]
""",
    "ned": """[sensors.velocity]
kind = "ned"
topic = "/gnss/ned"
fields = ["north", "east"]
unit = "m/s"
""",
    "body": """[sensors.velocity]
kind = "body"
topic = "/ship/state"
fields = ["surge_mps", "sway_mps"]
unit = "m/s"
""",
    "heading": """[sensors.heading]
topic = "/gyro"
field = "heading_deg"
unit = "deg"
""",
    "yaw_rate": """[sensors.yaw_rate]
topic = "/gyro"
field = "yaw_rate_degps"
unit = "deg/s"
""",
    "wind": """[sensors.wind]
topic = "/wind/apparent"
fields = ["speed_mps", "direction_deg"]
units = ["m/s", "deg"]
""",
    "rudder": """[[actuators]]
name = "rudder"
kind = "rudder"
topic = "/rudder/main"
field = "angle_deg"
unit = "deg"
""",
    "propeller": """[[actuators]]
name = "propeller"
kind = "propeller"
topic = "/propeller/shaft_1"
field = "speed_rps"
unit = "rps"
""",
}  # fmt: skip
DATUM = f"[site]\ndatum = [{LATITUDE}, {LONGITUDE}]\n"
COMMON = ("position", "sog_cog", "heading", "rudder", "propeller")


def profile_of(*parts: str, table: str = ""):
    text = '[ship]\nname = "circle"\nlength_m = 20.0\n' + "".join(SENSORS[p] for p in parts)
    return profiles.parse(text + DATUM + ("[table]\n" + table if table else ""), "test")


def direct(folder: Path, profile, voyage: Voyage, extra: dict | None = None) -> pl.DataFrame:
    """The same voyage written topic by topic with the log writer, and ingested."""
    v = voyage
    north, east = v.velocity
    drift = v.course - v.heading
    state = {
        "x0_m": v.north, "y0_m": v.east,
        "surge_mps": SPEED * np.cos(drift), "sway_mps": SPEED * np.sin(drift),
    }  # fmt: skip
    everything = {
        "/gnss/fix": ("foxglove.LocationFix", {"latitude": v.latitude, "longitude": v.longitude}),
        "/gnss/velocity": (
            "shiplog.GnssVelocity",
            {"sog_mps": np.full(len(v.t), SPEED), "cog_deg": v.course_deg},
        ),
        "/gnss/ned": ("test.Ned", {"north": north, "east": east}),
        "/ship/state": ("shiplog.ShipState", state),
        "/gyro": (
            "shiplog.Gyro",
            {"heading_deg": v.heading_deg, "yaw_rate_degps": np.full(len(v.t), np.degrees(RATE))},
        ),
        "/wind/apparent": (
            "shiplog.Wind", {"speed_mps": v.wind_speed, "direction_deg": v.wind_angle},
        ),
        "/rudder/main": ("shiplog.Rudder", {"angle_deg": v.rudder}),
        "/propeller/shaft_1": ("shiplog.Propeller", {"speed_rps": v.rps}),
    }  # fmt: skip
    wanted = profile.wanted()
    write_log(
        folder / "direct.mcap",
        [Series(t, schema, v.ns, c) for t, (schema, c) in everything.items() if t in wanted],
        ship="circle",
    )
    return ingest(folder / "direct.mcap", profile).table


TOLERANCE = {  # what the layouts' own decimals allow, all below a sensor's noise
    "x0": 0.02, "y0": 0.02, "surge": 2e-3, "sway": 2e-3, "heading": 2e-5, "yaw_rate": 2e-4,
    "rudder": 2e-4, "propeller": 2e-3, "wind_speed": 2e-3, "wind_angle": 2e-3,
}  # fmt: skip


def same(
    converted: Path, profile, known: pl.DataFrame, relative_time: bool = False,
    coarser: dict[str, float] | None = None,
) -> None:  # fmt: skip
    """Every value of every channel, at the same time; angles modulo 2π.

    coarser  channel → what a format's own resolution allows, where that is more
    """
    found = ingest(converted, profile).table
    if relative_time:
        found = found.with_columns(pl.col("time") - found["time"][0] + known["time"][0])
    assert found.height == known.height
    apart = (found["time"] - known["time"]).dt.total_nanoseconds().abs().max()
    assert apart < 1_000_000  # ms, which some layouts round to
    for name in profile.columns:
        ours, theirs = found[name].to_numpy(), known[name].to_numpy()
        assert np.isfinite(theirs).sum() > 0.9 * len(theirs)
        assert (np.isfinite(ours) == np.isfinite(theirs)).all(), name
        off = ours - theirs
        if name in ("heading", "wind_angle"):
            off = np.angle(np.exp(1j * off))
        assert np.nanmax(np.abs(off)) < (coarser or {}).get(name, TOLERANCE[name]), name


def converted(folder: Path, source: Path, profile) -> list[Path]:
    done = convert([source], profile, folder / "logs")
    assert not done.refused and not done.lost, (done.refused, done.lost)
    return done.logs


def iso(unix: float, form: str = "%Y-%m-%dT%H:%M:%S") -> str:
    whole = datetime.fromtimestamp(round(unix * 1000) / 1000, UTC)
    return whole.strftime(form) + f".{round(unix * 1000) % 1000:03d}"
