"""Wrong profiles: those that can be seen are named; of the others, a copy proves that none can.

A copy is another ship or world. Its record, read through the profile that is right for it, is the
record of the first ship read through the wrong one. Motion, wind and instruments are worked out
here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from known_motion import KNOT, swinging

from pipelines.experiments.wrong_profiles.profiles import WRONG, Wrong, text_of
from pipelines.experiments.wrong_profiles.seen import seen
from shiplog.logs.conversion.write import Series, write_log
from shiplog.ship_profile import file as profile_file
from shiplog.voyages.ingest.ingest import ingest

BY_NAME = {wrong.name: wrong for wrong in WRONG}
DATUM, METRE = (34.82, 135.52), 111_000.0
START = 1_700_000_000_000_000_000


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("heading anticlockwise", "sign = 1.0 on [sensors.heading]"),
        ("yaw rate: deg/s as deg/min", 'unit = "deg/s" on [sensors.yaw_rate]'),
        ("speed: m/s as knots", 'units = ["m/s", "deg"] on [sensors.velocity]'),
        ("longitude to the west", "sign = 1.0 on [sensors.position]"),
        ("mass in tonnes", "ship.mass_kg"),
        ("twin rudders exchanged", "`topic` and `field` of the two [[actuators]]"),
    ],
)
def test_what_can_be_seen_is_named_with_its_key_and_nothing_else(name, key):
    found = seen(BY_NAME[name], "voyage_1")
    assert found.seen_by == BY_NAME[name].seen_by
    assert key in found.key
    assert found.others == ()


@dataclass(frozen=True)
class World:
    """A ship of 3 m that swings: [n] at 10 Hz, over ground as complex north + i east, SI.

    wind      where it comes from     antenna   ahead + i starboard of midship
    """

    time: np.ndarray
    heading: np.ndarray
    rate: np.ndarray
    midship: np.ndarray
    velocity: np.ndarray
    wind: np.ndarray
    antenna: complex
    port: np.ndarray
    starboard: np.ndarray
    shaft: np.ndarray

    @property
    def bow(self):
        return np.exp(1j * self.heading)

    @property
    def apparent(self):
        """Over the bow + i over the starboard side."""
        return (self.wind + self.velocity) / self.bow

    def with_apparent(self, apparent) -> World:
        """The world in which the wind makes this on the mast."""
        return replace(self, wind=apparent * self.bow - self.velocity)


def here() -> World:
    ship = swinging(seconds=600.0, speed=0.15, turn=7.0, length_s=3.0)
    t, bow = ship.time, np.exp(1j * ship.heading)
    gusts = np.random.default_rng(3).normal(size=(2, len(t)))
    slow = np.exp(-np.arange(200) / 50.0)
    gusts = np.stack([np.convolve(one, slow / np.linalg.norm(slow), "same") for one in gusts])
    helm = ship.drives["rudder"]
    return World(
        time=t, heading=ship.heading, rate=ship.rate, midship=ship.north + 1j * ship.east,
        velocity=(ship.surge + 1j * ship.sway) * bow,
        wind=2.0 * np.exp(0.9j) + 0.3 * (gusts[0] + 1j * gusts[1]), antenna=0.3,
        port=0.5 * helm, starboard=0.4 * helm + math.radians(4.0) * np.sin(0.11 * t),
        shaft=ship.drives["propeller"],
    )  # fmt: skip


def log_of(world: World, path):
    """What the recorder writes: noise of the receiver and of the gyro is that of its place."""
    g, n = np.random.default_rng(5), len(world.time)
    noise = g.normal(size=(6, n))
    place = world.midship + world.antenna * world.bow + 0.02 * (noise[0] + 1j * noise[1])
    moves = world.velocity + 1j * world.rate * world.antenna * world.bow
    moves = moves + 0.01 * (noise[2] + 1j * noise[3])
    heading = np.degrees(world.heading) + 0.1 * noise[4]
    air = world.apparent
    stamps = START + np.round(1e9 * world.time).astype(np.int64)
    columns = {
        "/gnss/fix": {
            "latitude": DATUM[0] + place.real / METRE,
            "longitude": DATUM[1] + place.imag / METRE / math.cos(math.radians(DATUM[0])),
        },
        "/gnss/velocity": {
            "sog_mps": np.abs(moves), "cog_deg": np.degrees(np.angle(moves)) % 360.0
        },
        "/gyro": {
            "heading_deg": heading % 360.0,
            "yaw_rate_degps": np.degrees(world.rate) + 0.1 * noise[5],
        },
        "/wind/apparent": {
            "speed_mps": np.abs(air), "direction_deg": np.degrees(np.angle(air)) % 360.0
        },
        "/rudder/port": {"angle_deg": np.degrees(world.port)},
        "/rudder/starboard": {"angle_deg": np.degrees(world.starboard)},
        "/propeller/main": {"speed_rps": world.shaft},
    }  # fmt: skip
    write_log(path, [
        Series(topic, f"test.T{i}", stamps, of) for i, (topic, of) in enumerate(columns.items())
    ], ship="known ship, VecTwin")  # fmt: skip
    return path


def turned(world: World) -> World:
    """A hull that lies 7 deg further to starboard on the same way, the same air on its mast."""
    heading = world.heading + math.radians(7.0)
    back = world.antenna * (world.bow - np.exp(1j * heading))  # the antenna stays where it was
    other = replace(
        world, heading=heading, midship=world.midship + back,
        velocity=world.velocity + 1j * world.rate * back,
    )  # fmt: skip
    return other.with_apparent(world.apparent)


def longer_aft(world: World) -> World:
    """A ship whose antenna is 0.3 m abaft midship: 0.6 m ahead of the first one's midship."""
    forward = 0.6 * world.bow
    other = replace(
        world, midship=world.midship + forward, antenna=-0.3,
        velocity=world.velocity + 1j * world.rate * forward,
    )  # fmt: skip
    return other.with_apparent(world.apparent)


def crossed(world: World) -> World:
    return replace(world, port=world.starboard, starboard=world.port)


# name → the copy, and the profile that is right for it: the sample ship's, with these changes
COPIES = {
    "heading + 7 deg": (turned, None),
    "lever arm turned round": (longer_aft, "lever arm turned round"),
    "twin rudders exchanged, with their limits": (crossed, None),
    "wind: where it blows to": (lambda w: w.with_apparent(-w.apparent), None),
    "wind: m/s as knots": (lambda w: w.with_apparent(KNOT * w.apparent), None),
    "wind angle + 90": (lambda w: w.with_apparent(1j * w.apparent), None),
    "length in feet, no block coefficient": (
        lambda w: w, "length in feet, no block coefficient",
    ),
}  # fmt: skip


def profile(wrong: Wrong | None):
    return profile_file.parse(text_of(wrong), "wrong profile")


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    return log_of(here(), tmp_path_factory.mktemp("worlds") / "voyage.mcap")


def same(one, other):
    """Tables [n] and estimates of two voyages, to the accuracy of floats."""
    assert one.columns == other.columns and one.height == other.height
    for name in one.columns:
        a, b = one[name].to_numpy(), other[name].to_numpy()
        if name in ("heading", "wind_angle"):
            a, b = np.exp(1j * a), np.exp(1j * b)
        if name == "time" or a.dtype.kind in "iu":
            assert (a == b).all(), name
        else:
            assert np.abs(a - b).max() < 1e-8, name


def test_every_undetermined_profile_has_its_copy():
    assert set(COPIES) == {one.name for one in WRONG if one.seen_by == "undetermined"}
    assert all(one.copy for one in WRONG if one.seen_by == "undetermined")


@pytest.mark.parametrize("name", COPIES)
def test_a_copy_of_another_ship_or_world_has_the_same_record_and_is_not_told_apart(
    name, first, tmp_path
):
    """All that ingest compares is made of the table: it says the same of both, to the digit."""
    other, right = COPIES[name]
    wrong = BY_NAME[name]
    read_wrong = ingest(first, profile(wrong))
    copy = ingest(log_of(other(here()), tmp_path / "voyage.mcap"), profile(BY_NAME.get(right)))
    same(read_wrong.table, copy.table)
    assert len(read_wrong.estimates) == len(copy.estimates) > 0
    for a, b in zip(read_wrong.estimates, copy.estimates, strict=True):
        assert (a.kind, a.channel) == (b.kind, b.channel)
        assert (a.value, a.low, a.high) == pytest.approx((b.value, b.low, b.high), abs=1e-6)
    assert read_wrong.report.findings == copy.report.findings == ()
    said = {one.what for one in read_wrong.report.not_compared}
    assert any((wrong.listed or wrong.channel) in what for what in said)
    assert {one.what for one in copy.report.not_compared} == said


@pytest.mark.parametrize("name", COPIES)
def test_the_copy_is_as_likely_as_the_ship(name, first):
    """The residuals of all that ingest fits are those of the right profile; and the wind of the
    copy is no less steady than a wind with these gusts is."""
    right, wrong = ingest(first, profile(None)), ingest(first, profile(BY_NAME[name]))
    for a, b in zip(right.estimates, wrong.estimates, strict=True):
        assert (a.value, a.low, a.high) == pytest.approx(
            (b.value, b.low, b.high), rel=1e-3, abs=1e-4
        )
    mine, other = here(), COPIES[name][0](here())
    assert varies(other.wind) < 1.4 * varies(mine.wind)


def varies(wind):
    """What of a wind is no mean and no trend, as a share of the mean."""
    t = np.linspace(-1.0, 1.0, len(wind))
    mean = wind.mean()
    trend = (wind * t).mean() / (t**2).mean()
    return float(np.sqrt(np.mean(np.abs(wind - mean - trend * t) ** 2)) / abs(mean))


def test_the_table_of_a_length_in_feet_is_the_same_to_the_digit(first):
    name = "length in feet, no block coefficient"
    right, wrong = ingest(first, profile(None)), ingest(first, profile(BY_NAME[name]))
    assert right.table.equals(wrong.table)
