"""Instruments without a fault, coarse and fine, slow and fast, at rest and in waves: no finding of
a spike, a jump or a held value; and each real fault in the same records."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import sailing

from shiplog.logs.conversion.write import Series
from shiplog.nomenclature.channels import Quality
from shiplog.voyages.ingest.ingest import ingest

HEAD = """
[ship]
name = "swinging"
length_m = {length}
[site]
datum = [54.0, 10.0]
[sensors.position]
kind = "geodetic"
topic = "/fix"
fields = ["lat", "lon"]
unit = "deg"
[sensors.velocity]
kind = "sog_cog"
topic = "/velocity"
fields = ["sog", "cog"]
units = ["m/s", "deg"]
[sensors.heading]
topic = "/compass"
field = "heading"
unit = "deg"
"""
GYRO = """[sensors.yaw_rate]
topic = "/gyro"
field = "rate"
unit = "deg/s"
"""
WIND = """[sensors.wind]
topic = "/wind"
fields = ["speed", "angle"]
units = ["m/s", "deg"]
"""
FALSE = {"spike", "jump", "held"}
NORTH, EAST = 111_312.3, 65_577.2  # m of a degree of latitude and longitude at 54 N


@dataclass(frozen=True)
class Instruments:
    """Rates [Hz], noises (one standard deviation) and steps, in m, m/s, deg and deg/s."""

    hz: float = 10.0
    fix: tuple[float, float] = (0.02, 0.0)  # noise m, step in degrees
    sog: tuple[float, float] = (0.01, 0.0)
    cog: tuple[float, float] = (0.3, 0.0)
    compass: tuple[float, float] = (0.1, 0.0)
    gyro: tuple[float, float] | None = (0.1, 0.0)


def stepped(value, step):
    return np.round(value / step) * step if step else value


def truth(t, speed=2.0, swing=40.0, period=90.0, rest=(), waves=0.0):
    """A ship that swings by ±`swing` deg, lies still in `rest` (from, to) and rolls in waves.

    The position is the velocity's integral, worked out on a fine grid by the trapezoidal rule.
    """
    fine = np.arange(0.0, t[-1] + 0.02, 0.01)
    turn = 2.0 * np.pi / period
    pace = np.ones(len(fine))
    for begin, end in rest:  # comes to rest within 15 s, and starts within 15 s
        pace *= np.clip(np.maximum((begin - fine) / 15.0, (fine - end) / 15.0), 0.0, 1.0)
    phase = np.cumsum(pace) * 0.01
    heading = 70.0 + swing * np.sin(turn * phase) + waves * np.sin(2.0 * np.pi * fine / 7.0)
    surge = speed * pace + 0.05 * waves * np.sin(2.0 * np.pi * fine / 6.0)
    north, east = (surge * g(np.radians(heading)) for g in (np.cos, np.sin))
    x, y = (np.concatenate(([0.0], np.cumsum(v[1:] + v[:-1]) * 0.005)) for v in (north, east))
    rate = np.gradient(heading, fine)
    columns = {"x": x, "y": y, "heading": heading, "surge": surge, "rate": rate}
    return {name: np.interp(t, fine, column) for name, column in columns.items()}


def record(kind: Instruments, seconds=240.0, seed=1, length=10.0, **how):
    """Topics of one voyage and the profile's text."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 1.0 / kind.hz)
    ship = truth(t, **how)

    def with_noise(value, accuracy):
        noise, step = accuracy
        return stepped(value + rng.normal(0.0, noise, len(t)) if noise else value, step)

    noise, step = kind.fix
    north, east = (rng.normal(0.0, noise, len(t)) if noise else 0.0 * t for _ in range(2))
    fix = {
        "lat": stepped(54.0 + (ship["x"] + north) / NORTH, step),
        "lon": stepped(10.0 + (ship["y"] + east) / EAST, step),
    }
    still = np.abs(ship["surge"]) < 0.05
    sog = np.where(still, 0.0, np.abs(with_noise(ship["surge"], kind.sog)))
    cog = with_noise(ship["heading"], kind.cog) % 360.0
    parts = {
        "/fix": fix, "/velocity": {"sog": sog, "cog": cog},
        "/compass": {"heading": with_noise(ship["heading"], kind.compass) % 360.0},
    }  # fmt: skip
    text = HEAD.format(length=length)
    if kind.gyro is not None:
        parts["/gyro"] = {"rate": with_noise(ship["rate"], kind.gyro)}
        text += GYRO
    stamps = sailing.stamps(t)
    return {name: Series(name, f"test.{name[1:]}", stamps, c) for name, c in parts.items()}, text


def stored(tmp_path, parts, text):
    return ingest(sailing.write(tmp_path / "a.mcap", parts), sailing.profile(text))


def false_alarms(voyage):
    return [f.sentence for f in voyage.report.findings if f.kind in FALSE]


def usable(voyage):
    unusable = int(Quality.GAP | Quality.BLANK | Quality.SPIKE | Quality.FROZEN | Quality.LIMITS)
    return (voyage.table["quality"].to_numpy() & unusable) == 0


E7, MINUTE_4, MINUTE_3, DECIMALS_5 = 1e-7, 1e-4 / 60.0, 1e-3 / 60.0, 1e-5  # deg
SOUND = {
    "fine, 10 Hz": (Instruments(), {}),
    "no gyro, 10 Hz": (Instruments(gyro=None), {}),
    "whole degrees, 10 Hz": (Instruments(compass=(0.2, 1.0)), {}),
    "whole degrees, 1 Hz, no gyro": (Instruments(hz=1.0, compass=(0.2, 1.0), gyro=None), {}),
    "whole degrees on a straight course": (
        Instruments(hz=1.0, compass=(0.2, 1.0), gyro=None), {"swing": 1.5}),
    "tenths of a knot": (Instruments(hz=1.0, sog=(0.02, 0.0514444), cog=(0.5, 1.0)), {}),
    "1e-4 minutes": (Instruments(hz=1.0, fix=(0.05, MINUTE_4), gyro=None), {}),
    "1e-3 minutes": (Instruments(hz=1.0, fix=(0.3, MINUTE_3)), {}),
    "1e-7 deg at 10 Hz, RTK": (Instruments(fix=(0.005, E7)), {}),
    "AIS, each 10 s": (Instruments(
        hz=0.1, fix=(0.5, 1e-4 / 60.0), sog=(0.02, 0.0514444), cog=(0.5, 0.1), compass=(0.2, 1.0),
        gyro=None), {"seconds": 3000.0, "period": 400.0, "length": 90.0}),
    "0.2 Hz": (Instruments(hz=0.2, compass=(0.3, 0.1), gyro=None),
               {"seconds": 2000.0, "period": 300.0}),
    "moored for half": (Instruments(hz=1.0, fix=(0.3, MINUTE_4), sog=(0.02, 0.01), cog=(1.0, 1.0),
                                    compass=(0.3, 1.0), gyro=None),
                        {"seconds": 1200.0, "rest": ((300.0, 900.0),)}),
    "moored all the time": (Instruments(hz=1.0, fix=(0.3, MINUTE_4), compass=(0.3, 1.0)),
                            {"seconds": 900.0, "rest": ((-100.0, 2000.0),)}),
    "moored, a fine gyro": (Instruments(fix=(0.01, E7), gyro=(0.01, 0.0)),
                            {"seconds": 300.0, "rest": ((60.0, 220.0),)}),
    "moored, gyro in steps": (Instruments(hz=5.0, fix=(0.01, E7), gyro=(0.01, 0.1)),
                              {"seconds": 300.0, "rest": ((60.0, 220.0),)}),
    "in waves": (Instruments(), {"waves": 3.0}),
    "in waves, whole degrees": (Instruments(hz=2.0, compass=(0.2, 1.0)), {"waves": 3.0}),
    "in waves, 1 Hz, no gyro": (Instruments(hz=1.0, gyro=None), {"waves": 5.0}),
    "agile": (Instruments(fix=(0.005, E7), compass=(0.01, 0.0), gyro=(0.02, 0.0)),
              {"swing": 120.0, "period": 20.0, "rest": ((60.0, 180.0),)}),
    "50 Hz": (Instruments(hz=50.0), {"seconds": 120.0}),
    "noiseless": (Instruments(fix=(0.0, 0.0), sog=(0.0, 0.0), cog=(0.0, 0.0), compass=(0.0, 0.0),
                              gyro=(0.0, 0.0)), {"rest": ((100.0, 200.0),)}),
}  # fmt: skip


@pytest.mark.parametrize("name", SOUND)
def test_a_sound_instrument_has_no_false_alarm(tmp_path, name):
    kind, how = SOUND[name]
    voyage = stored(tmp_path, *record(kind, **how))
    assert false_alarms(voyage) == []
    assert usable(voyage).mean() > 0.99


@pytest.mark.parametrize("hz", [0.5, 1.0, 10.0])
@pytest.mark.parametrize("scale", [0.3, 2.0])
def test_a_gusty_wind_has_no_spikes_and_a_spike_in_it_is_found(tmp_path, hz, scale):
    parts, text = record(Instruments(hz=2.0), seconds=300.0)
    rng = np.random.default_rng(4)
    t = np.arange(0.0, 300.0, 1.0 / hz)
    slow = np.exp(np.interp(t, np.arange(0.0, 301.0, 20.0), rng.normal(0.0, 0.5, 16)))
    eddies = np.interp(t, np.arange(0.0, 301.0, 1.0), rng.normal(0.0, 1.0, 301))
    speed = np.abs(4.0 + scale * slow * eddies)  # squalls: how gusty it is changes all the time
    angle = (40.0 + 8.0 * slow * rng.normal(0.0, 1.0, len(t))) % 360.0
    columns = {"speed": speed, "angle": angle}
    parts["/wind"] = Series("/wind", "test.Wind", sailing.stamps(t), columns)
    voyage = stored(tmp_path, parts, text + WIND)
    assert false_alarms(voyage) == []
    speed[int(100 * hz)] += 55.0
    other = tmp_path / "other"
    other.mkdir()
    found = stored(other, parts, text + WIND).report.findings
    (spike,) = [f for f in found if f.kind in FALSE]
    assert (spike.kind, spike.channel) == ("spike", "wind")
    assert spike.start_s <= 100.0 <= spike.end_s


COARSE = Instruments(hz=1.0, fix=(0.3, MINUTE_4), sog=(0.02, 0.0514444), cog=(0.5, 1.0),
                     compass=(0.2, 1.0), gyro=None)  # fmt: skip
FINE = Instruments()


@pytest.mark.parametrize("kind", [COARSE, FINE], ids=["coarse", "fine"])
@pytest.mark.parametrize(
    ("topic", "field", "size", "channel"),
    [("/compass", "heading", 60.0, "heading"), ("/fix", "lat", 40.0 / NORTH, "position"),
     ("/fix", "lon", 1e4 / EAST, "position"), ("/velocity", "sog", 6.0, "velocity")],
)  # fmt: skip
def test_a_spike_is_found(tmp_path, kind, topic, field, size, channel):
    parts, text = record(kind)
    parts[topic].columns[field][int(133.0 * kind.hz)] += size
    voyage = stored(tmp_path, parts, text)
    (spike,) = [f for f in voyage.report.findings if f.kind in FALSE]
    assert (spike.kind, spike.channel) == ("spike", channel)
    assert spike.start_s - 1.0 <= 133.0 <= spike.end_s + 1.0
    rate = np.degrees(voyage.table["yaw_rate"].to_numpy()[usable(voyage)])
    assert np.abs(rate).max() < 12.0  # 2.8 deg/s, whole degrees and noise


@pytest.mark.parametrize("kind", [COARSE, FINE, replace(FINE, gyro=None)], ids=str)
@pytest.mark.parametrize(
    ("topic", "field", "size", "channel"),
    [("/compass", "heading", -75.0, "heading"), ("/fix", "lat", 40.0 / NORTH, "position"),
     ("/fix", "lon", -25.0 / EAST, "position")],
)  # fmt: skip
def test_a_step_is_found(tmp_path, kind, topic, field, size, channel):
    parts, text = record(kind)
    column = parts[topic].columns[field]
    column[int(133.0 * kind.hz) :] += size
    if field == "heading":
        column %= 360.0
    (jump,) = [f for f in stored(tmp_path, parts, text).report.findings if f.kind in FALSE]
    assert (jump.kind, jump.channel) == ("jump", channel)
    assert jump.start_s == pytest.approx(133.0, abs=1.01)
    metres = {"lat": NORTH, "lon": EAST, "heading": 1.0}[field]
    assert jump.value == pytest.approx(abs(size * metres), abs=4.0)


@pytest.mark.parametrize("turns", [-370.0, -190.0, 190.0, 350.0])
def test_no_heading_steps_by_more_than_half_a_turn(tmp_path, turns):
    parts, text = record(FINE)
    heading = parts["/compass"].columns["heading"]
    heading[1330:] = (heading[1330:] + turns) % 360.0
    (jump,) = [f for f in stored(tmp_path, parts, text).report.findings if f.kind in FALSE]
    assert jump.value == pytest.approx(abs((turns + 180.0) % 360.0 - 180.0), abs=1.0)


@pytest.mark.parametrize(("hz", "swing"), [(1.0, 30.0), (1.0, 57.0), (5.0, 57.0), (10.0, 30.0)])
def test_a_frozen_heading_is_found_by_the_course_where_nobody_measured_a_rate(tmp_path, hz, swing):
    kind = replace(FINE, hz=hz, gyro=None)
    parts, text = record(kind, seconds=900.0, swing=swing, period=200.0)
    frozen = slice(int(300 * hz), int(700 * hz))
    parts["/compass"].columns["heading"][frozen] = np.degrees(0.5)
    voyage = stored(tmp_path, parts, text)
    (held,) = [f for f in voyage.report.findings if f.kind == "held" and f.channel == "heading"]
    assert held.start_s == pytest.approx(300.0, abs=1.1)
    assert held.end_s == pytest.approx(700.0, abs=1.1)
    assert not usable(voyage)[3020:6980].any()


NO_FIX, ELSEWHERE = (0.0, 0.0), (53.0, 9.0)


@pytest.mark.parametrize(
    ("seconds", "at", "place", "kind"),
    [(0.3, 0.0, NO_FIX, FINE), (0.3, 133.0, ELSEWHERE, FINE), (0.3, 220.0, NO_FIX, COARSE),
     (1.0, 0.0, ELSEWHERE, COARSE), (1.0, 133.0, NO_FIX, COARSE), (1.0, 220.0, ELSEWHERE, FINE),
     (3.0, 0.0, NO_FIX, COARSE), (3.0, 133.0, ELSEWHERE, COARSE), (3.0, 220.0, NO_FIX, FINE),
     (3.0, 0.0, ELSEWHERE, FINE), (19.9, 0.0, NO_FIX, FINE), (19.9, 133.0, NO_FIX, FINE),
     (19.9, 133.0, ELSEWHERE, COARSE), (19.9, 220.0, ELSEWHERE, FINE)],
)  # fmt: skip
def test_a_lost_fix_is_no_position(tmp_path, kind, seconds, at, place):
    parts, text = record(kind)
    lost = slice(round(at * kind.hz), max(round((at + seconds) * kind.hz), round(at * kind.hz) + 2))
    lasts = (lost.stop - lost.start) / kind.hz
    for field, value in zip(("lat", "lon"), place, strict=True):
        parts["/fix"].columns[field][lost] = value
    voyage = stored(tmp_path, parts, text)
    x, y = (voyage.table[c].to_numpy()[usable(voyage)] for c in ("x0", "y0"))
    assert np.hypot(x, y).max() < 1000.0
    of_values = {"blank", "implausible", "not_available"}
    found = [f for f in voyage.report.findings if f.kind in {*FALSE, *of_values}]
    if at == 0.0 and lasts <= 1.0:  # the voyage begins with the last of its instruments
        assert len(found) <= 1
        return
    (blank,) = found
    assert blank.kind in of_values and blank.channel == "position"
    within = 0.35 + 1.0 / kind.hz
    assert (~usable(voyage)).sum() * 0.1 == pytest.approx(lasts, abs=within)


@pytest.mark.parametrize("kind", [COARSE, FINE], ids=["coarse", "fine"])
@pytest.mark.parametrize(
    ("topic", "fields", "channel"),
    [("/fix", ("lat", "lon"), "position"), ("/velocity", ("sog", "cog"), "velocity")],
)
def test_a_held_value_is_found_while_the_ship_moves(tmp_path, kind, topic, fields, channel):
    parts, text = record(kind, swing=60.0)
    begin, end = int(133.0 * kind.hz), int(173.0 * kind.hz)
    for field in fields:
        parts[topic].columns[field][begin:end] = parts[topic].columns[field][begin]
    voyage = stored(tmp_path, parts, text)
    (held,) = [f for f in voyage.report.findings if f.kind in ("held", "spike")]
    assert (held.kind, held.channel) == ("held", channel)
    assert held.start_s == pytest.approx(133.0, abs=1.1)
    assert not usable(voyage)[1350:1720].any()


def test_a_yaw_rate_that_is_held_is_found(tmp_path):
    parts, text = record(FINE)
    parts["/gyro"].columns["rate"][1330:1500] = parts["/gyro"].columns["rate"][1330]
    (held,) = [f for f in stored(tmp_path, parts, text).report.findings if f.kind in FALSE]
    assert (held.kind, held.channel) == ("held", "yaw_rate")


@pytest.mark.parametrize("digits", [3, 4])
def test_numbers_of_a_few_digits_are_not_held(tmp_path, digits):
    """A heading of three digits counts in 0.1 deg below 100 and in 1 deg beyond."""
    parts, text = record(FINE, swing=100.0, period=300.0, seconds=360.0)
    heading = parts["/compass"].columns["heading"]
    with np.errstate(divide="ignore"):
        step = 10.0 ** (np.floor(np.log10(np.abs(heading))) - digits + 1)
    parts["/compass"].columns["heading"] = np.round(heading / step) * step
    voyage = stored(tmp_path, parts, text)
    assert false_alarms(voyage) == []
    parts["/compass"].columns["heading"][2000:2400] = parts["/compass"].columns["heading"][2000]
    other = tmp_path / "other"
    other.mkdir()
    found = [f for f in stored(other, parts, text).report.findings if f.kind == "held"]
    assert any(f.channel == "heading" and f.start_s == pytest.approx(200.0, abs=3) for f in found)


@pytest.mark.parametrize(
    ("hz", "rows", "size"),
    [(10.0, (1200,), 90.0), (1.0, (120, 200), -60.0), (5.0, (600, 601), 45.0)],
    ids=["10 Hz", "1 Hz, twice", "5 Hz, two samples"],
)  # fmt: skip
def test_beside_a_spike_the_heading_is_differentiated_over_it(tmp_path, hz, rows, size):
    """Of a heading without a gyro: the rate in rows that bear no mark is the ship's."""
    kind = Instruments(hz=hz, fix=(0.0, 0.0), sog=(0.0, 0.0), cog=(0.0, 0.0), compass=(0.0, 0.0),
                       gyro=None)  # fmt: skip
    parts, text = record(kind)
    heading = parts["/compass"].columns["heading"].copy()
    heading[list(rows)] = (heading[list(rows)] + size) % 360.0
    parts["/compass"] = replace(parts["/compass"], columns={"heading": heading})
    voyage = stored(tmp_path, parts, text)
    times = voyage.table["time"].to_physical().to_numpy()
    rate = truth((times - sailing.START) * 1e-9)["rate"]
    off = np.abs(np.degrees(voyage.table["yaw_rate"].to_numpy()) - rate)[usable(voyage)]
    assert [f.kind for f in voyage.report.findings if f.kind in FALSE] == ["spike"] * len(
        {row // 2 for row in rows}
    )
    assert off.max() < 0.2  # deg/s, of 2.8; beside the spike it was hundreds
