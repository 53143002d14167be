"""What a ship measures does not depend on where north is, when it sailed or how it is written.

Each property takes one voyage, changes its messages in a way whose result is known beforehand, and
holds the table against the one that was to come.
"""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
import sailing
from hypothesis import given, settings
from hypothesis import strategies as st

from shiplog.logs.reading.read import read
from shiplog.voyages.ingest.ingest import build

FEW = settings(max_examples=12, deadline=None)
YEAR = 365 * 86_400 * 10**9  # ns
TIMES = ("log_time", "publish_time", "stamp")
ARM = "lever_arm_m = [0.7, -0.2]"
ANGLES = {"/velocity": "cog_deg", "/gyro": "heading_deg", "/wind": "direction_deg"}
# Of a field, what its unit is exactly: metres, seconds, and parts of a turn (NIST SP 811, App. B).
IN_METRES_PER_SECOND = {
    "m/s": 1.0, "cm/s": 0.01, "mm/s": 0.001, "km/h": 1000 / 3600, "kn": 1852 / 3600,
    "knots": 1852 / 3600, "mph": 1609.344 / 3600,
}  # fmt: skip
IN_METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "ft": 0.3048}
IN_DEGREES = {"deg": 1.0, "rad": 360 / (2 * np.pi)}
IN_DEGREES_PER_MINUTE = {"deg/min": 1.0, "deg/s": 60.0, "rad/s": 60 * 360 / (2 * np.pi)}
IN_RPM = {"rpm": 1.0, "rps": 60.0, "rev/s": 60.0}


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A turn with noise, a sensor that falls out, a spike and a rudder beyond its limits."""
    rng, parts = np.random.default_rng(3), sailing.series(40.0)
    t = np.arange(0.011, 39.9, 0.103)  # a gyro of its own rate: no sample is on the grid but one
    parts["/gyro"] = replace(
        parts["/gyro"],
        time=sailing.stamps(t),
        columns={
            "heading_deg": np.degrees(3.0 + sailing.SPEED / sailing.RADIUS * t) % 360.0,
            "rate_degpmin": np.full(len(t), np.degrees(sailing.SPEED / sailing.RADIUS) * 60.0),
        },
    )
    for one in parts.values():
        for name, values in one.columns.items():
            one.columns[name] = values + rng.normal(0.0, 2e-3, len(values))
    parts["/rudder"].columns["angle_deg"][100:105] = 40.0
    parts["/position"].columns["x_m"][300] += 5.0
    parts["/velocity"] = replace(
        parts["/velocity"],
        time=parts["/velocity"].time[:-80],
        columns={name: values[:-80] for name, values in parts["/velocity"].columns.items()},
    )
    path = sailing.write(tmp_path_factory.mktemp("symmetries") / "turn.mcap", parts)
    return read(path, sailing.profile().wanted())


@pytest.fixture(scope="module")
def voyage(log):
    return build(log, sailing.profile())


def changed(log, **topics):
    """The log with columns of some topics replaced: {topic: expressions}."""
    frames = {t: f.with_columns(topics.get(t.strip("/"), [])) for t, f in log.frames.items()}
    return replace(log, frames=frames)


def assert_table(done, voyage, **expected):
    """The table of `voyage` but for these columns [m]; its marks are the same."""
    assert done.table["quality"].to_list() == voyage.table["quality"].to_list()
    for name in voyage.table.columns[1:-1]:
        wanted = expected.get(name, voyage.table[name].to_numpy())
        off = done.table[name].to_numpy() - wanted
        if name in ("heading", "wind_angle"):
            off = (off + np.pi) % (2 * np.pi) - np.pi
        assert np.isnan(off).sum() == voyage.table[name].null_count()
        assert np.nanmax(np.abs(off)) < 1e-9, name


@given(degrees=st.floats(-720.0, 720.0))
@FEW
def test_turned_earth_axes_turn_the_path_and_the_heading_and_nothing_else(log, voyage, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x, y = pl.col("x_m"), pl.col("y_m")
    turned = changed(
        log, position=[(c * x - s * y).alias("x_m"), (s * x + c * y).alias("y_m")],
        velocity=[(pl.col("cog_deg") + degrees) % 360], gyro=[(pl.col("heading_deg") + degrees)],
    )  # fmt: skip
    x0, y0 = voyage.table["x0"].to_numpy(), voyage.table["y0"].to_numpy()
    assert_table(
        build(turned, sailing.profile()), voyage, x0=c * x0 - s * y0, y0=s * x0 + c * y0,
        heading=voyage.table["heading"].to_numpy() + np.radians(degrees),
    )  # fmt: skip


def test_a_mirrored_ship_has_the_mirrored_motion(log, voyage):
    """Port becomes starboard: of the ship, of its antenna, of the wind and of the rudder."""
    mirrored = changed(
        log, position=[-pl.col("y_m")], velocity=[-pl.col("cog_deg")],
        gyro=[-pl.col("heading_deg"), -pl.col("rate_degpmin")], wind=[-pl.col("direction_deg")],
        rudder=[-pl.col("angle_deg")],
    )  # fmt: skip
    ship = sailing.profile(sailing.PROFILE.replace(ARM, "lever_arm_m = [0.7, 0.2]"))
    names = ("y0", "heading", "sway", "yaw_rate", "rudder", "wind_angle")
    assert_table(
        build(mirrored, ship), voyage, **{name: -voyage.table[name].to_numpy() for name in names}
    )


@given(later=st.integers(-40 * YEAR, 2 * YEAR))
@FEW
def test_a_voyage_at_another_time_is_the_same_voyage(log, voyage, later):
    times = [pl.col(name) + later for name in TIMES]
    done = build(changed(log, **dict.fromkeys(map(str, _topics(log)), times)), sailing.profile())
    moved = voyage.table.with_columns(
        (pl.col("time").to_physical() + later).cast(pl.Datetime("ns", "UTC")).alias("time")
    )
    assert done.table.equals(moved)
    assert done.report.findings == voyage.report.findings


@given(seed=st.integers(0, 2**32 - 1))
@FEW
def test_full_turns_that_an_instrument_adds_are_no_turns(log, voyage, seed):
    rng = np.random.default_rng(seed)
    turns = {
        topic.strip("/"): [pl.col(name) + 360.0 * pl.Series(rng.integers(-3, 4, count))]
        for topic, name in ANGLES.items()
        for count in [log.frames[topic].height]
    }
    assert_table(build(changed(log, **turns), sailing.profile()), voyage)


@given(st.data())
@FEW
def test_the_unit_that_a_log_is_written_in_changes_nothing(log, voyage, data):
    speed, course, length, heading, rate, shaft = (
        data.draw(st.sampled_from(sorted(units)), label)
        for label, units in (
            ("speed", IN_METRES_PER_SECOND), ("course", IN_DEGREES), ("position", IN_METRES),
            ("heading", IN_DEGREES), ("rate", IN_DEGREES_PER_MINUTE), ("shaft", IN_RPM),
        )
    )  # fmt: skip
    knot = 1852 / 3600
    written = changed(
        log,
        position=[pl.col("x_m", "y_m") / IN_METRES[length]],
        velocity=[
            pl.col("sog_kn") * (knot / IN_METRES_PER_SECOND[speed]),
            pl.col("cog_deg") / IN_DEGREES[course],
        ],
        gyro=[
            pl.col("heading_deg") / IN_DEGREES[heading],
            pl.col("rate_degpmin") / IN_DEGREES_PER_MINUTE[rate],
        ],
        propeller=[pl.col("speed_rpm") / IN_RPM[shaft]],
    )
    text = sailing.PROFILE
    for old, new in (
        ('unit = "m"\n', f'unit = "{length}"\n'),
        ('units = ["kn", "deg"]', f'units = ["{speed}", "{course}"]'),
        ('field = "heading_deg"\nunit = "deg"', f'field = "heading_deg"\nunit = "{heading}"'),
        ('unit = "deg/min"', f'unit = "{rate}"'),
        ('unit = "rpm"', f'unit = "{shaft}"'),
    ):
        assert old in text
        text = text.replace(old, new)
    # An accuracy is in the unit of its sensor (of a position in metres).
    text = text.replace(
        "sigma = 0.01\n[sensors.heading]",
        f"sigma = {0.01 * knot / IN_METRES_PER_SECOND[speed]!r}\n[sensors.heading]",
    )
    text = text.replace("sigma = 0.05", f"sigma = {0.05 / IN_DEGREES[heading]!r}")
    assert_table(build(written, sailing.profile(text)), voyage)


def _topics(log):
    return [topic.strip("/") for topic in log.frames]
