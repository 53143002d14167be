"""The log of a Signal K server: deltas, and what stands between them."""

import json
import math

import numpy as np
import pytest
from made_nmea import SPEED, START, gga, hdt, heading, iso, kinds, late, rmc, rudder, where

from shiplog.commands.convert import convert
from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion.signalk import is_signalk, read_signalk

SECONDS = range(60)
RADIAN = math.pi / 180.0


def delta(t, values, source="can0.7", context="vessels.self", timed=True):
    update = {"$source": source, "values": [{"path": p, "value": v} for p, v in values.items()]}
    if timed:
        update["timestamp"] = iso(t)
    return json.dumps({"context": context, "updates": [update]})


def ship(t, source="can0.7", **more):
    latitude, longitude = where(t)
    return delta(t, {
        "navigation.position": {"latitude": latitude, "longitude": longitude},
        "navigation.speedOverGround": SPEED,
        "navigation.courseOverGroundTrue": 45.0 * RADIAN,
        "navigation.headingTrue": float(heading(t)) * RADIAN,
        "steering.rudderAngle": float(rudder(t)) * RADIAN,
        "propulsion.port.revolutions": 12.5,
        "environment.wind.speedApparent": 5.0, "environment.wind.angleApparent": -0.5,
        "electrical.batteries.1.voltage": 12.6,
    }, source, **more)  # fmt: skip


def read(tmp_path, lines):
    (tmp_path / "a.log").write_text("\n".join(lines) + "\n")
    assert is_signalk(tmp_path / "a.log")
    found = read_signalk(tmp_path / "a.log")
    return {one.topic: one for one in found.series}, found


HELLO = json.dumps({"name": "s", "version": "1.7.0", "self": "vessels.urn:mrn:imo:mmsi:211000000"})
FORMS = {
    "deltas alone": [ship(t) for t in SECONDS],
    "with hello and another ship": [HELLO, *(
        b for t in SECONDS for b in (
            ship(t, context="vessels.urn:mrn:imo:mmsi:211000000"),
            ship(t + 500, context="vessels.urn:mrn:imo:mmsi:265000000")))],
    "milliseconds before each": [
        f"{round((START + t) * 1000)};I;{ship(t, timed=False)}" for t in SECONDS],
    "multiplexed with NMEA 2000": [b for t in SECONDS for b in (
        f"{round((START + t) * 1000)};I;{ship(t)}",
        f"{round((START + t) * 1000)};A;{iso(t)},6,127508,2,255,8,00,f7,04,ff,7f,ff,ff,ff")],
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_deltas_become_topics(tmp_path, form):
    topics, found = read(tmp_path, FORMS[form])
    assert sorted(topics) == [
        "/gnss/fix", "/gnss/velocity", "/gyro", "/propeller/port", "/rudder/main", "/wind/apparent",
    ]  # fmt: skip
    assert late(topics["/gyro"], heading, "heading_deg") < 1e-6
    assert late(topics["/rudder/main"], rudder, "angle_deg") < 1e-6
    columns = {name: one.columns for name, one in topics.items()}
    assert columns["/gnss/velocity"]["cog_deg"] == pytest.approx(np.full(60, 45.0))
    assert columns["/wind/apparent"]["direction_deg"] == pytest.approx(
        np.full(60, 360.0 - 0.5 / RADIAN)
    )
    assert columns["/propeller/port"]["speed_rps"].tolist() == [12.5] * 60
    assert found.damaged == 0
    n2k = [f.sentence for f in found.findings if f.kind == "dropped"]
    assert len(n2k) == (form == "multiplexed with NMEA 2000")
    assert all("127508 battery (60)" in sentence for sentence in n2k)


def test_nmea_2000_between_the_deltas_is_read_where_these_say_nothing(tmp_path):
    """A rudder at 0.1 rad, PGN 127245 (angle in 1e-4 rad, bytes 4 and 5), next to deltas of the
    rest; and a heading that the deltas have already."""
    lines = []
    for t in SECONDS:
        ms = round((START + t) * 1000)
        latitude, longitude = where(t)
        lines.append(f"{ms};I;" + delta(t, {
            "navigation.position": {"latitude": latitude, "longitude": longitude},
            "navigation.headingTrue": float(heading(t)) * RADIAN,
        }))  # fmt: skip
        lines.append(f"{ms};A;{iso(t)},2,127245,204,255,8,00,f8,ff,7f,e8,03,ff,ff")
        lines.append(f"{ms};A;{iso(t)},2,127250,204,255,8,ff,00,00,ff,7f,ff,7f,fc")
    topics, found = read(tmp_path, lines)
    (rudder_,) = [one for name, one in topics.items() if name.startswith("/rudder")]
    angle = next(iter(rudder_.columns.values()))
    np.testing.assert_allclose(np.degrees(0.1), angle, atol=1e-6)
    assert [name for name in topics if name.startswith("/gyro")] == ["/gyro"]
    assert late(topics["/gyro"], heading, "heading_deg") < 1e-6
    assert "not read" not in " ".join(f.sentence for f in found.findings)


def test_an_engine_turns_as_its_gear_does_and_without_one_the_draft_asks(tmp_path):
    """Revolutions are those before the gear, in Hz and without a sign."""
    words = {0: "Forward", 20: "Neutral", 30: "Reverse"}
    lines = []
    for t in SECONDS:
        gear = next(word for start, word in reversed(words.items()) if t >= start)
        engines = {"propulsion.port.revolutions": 20.0, "propulsion.starboard.revolutions": 10.0}
        lines.append(delta(t, engines | {"propulsion.port.transmission.gear": gear}))
        lines.append(ship(t, source="gps.1"))
    topics, found = read(tmp_path, lines)
    port, starboard = topics["/propeller/port/can0_7"], topics["/propeller/starboard"]
    assert port.columns["speed_rps"].tolist() == [20.0] * 20 + [0.0] * 10 + [-20.0] * 30
    assert starboard.columns["speed_rps"].tolist() == [10.0] * 60
    assert port.metadata["gear_ratio"] == starboard.metadata["gear_ratio"] == "1"
    assert "ahead or astern" in starboard.metadata["doubt"]
    assert "doubt" not in port.metadata
    assert "gear" not in " ".join(f.sentence for f in found.findings)


def test_nmea_0183_of_the_log_is_read_and_its_deltas_not_again(tmp_path):
    lines = []
    for t in SECONDS:
        ms = round((START + t) * 1000)
        lines += [f"{ms};N;{b}" for b in (gga(t), rmc(t), hdt(t))]
        lines.append(f"{ms};I;{ship(t, source='serial.GP')}")
    topics, _ = read(tmp_path, lines)
    assert {"/gnss/fix", "/gyro", "/rudder/main"} <= set(topics)
    assert topics["/gyro"].frame_id == "nmea" and topics["/rudder/main"].frame_id == "signalk"
    assert late(topics["/gyro"], heading, "heading_deg") < 1e-3


def test_a_compass_of_deltas_is_made_true(tmp_path):
    lines = []
    for t in SECONDS:
        latitude, longitude = where(t)
        shown = (float(heading(t)) - 4.0) % 360 * RADIAN
        lines.append(delta(t, {
            "navigation.position": {"latitude": latitude, "longitude": longitude},
            "navigation.headingMagnetic": shown, "navigation.magneticVariation": 4.0 * RADIAN,
        }))  # fmt: skip
    topics, found = read(tmp_path, lines)
    assert late(topics["/gyro"], heading, "heading_deg") < 1e-6
    assert kinds(found) == ["heading_offset"]


def test_two_sources_of_one_path_are_two_and_none_is_blank(tmp_path):
    lines = []
    for t in SECONDS:
        other = {"navigation.headingTrue": None if t % 2 else 1.0}
        lines += [ship(t), delta(t, other, "can0.9")]
    topics, _ = read(tmp_path, lines)
    assert late(topics["/gyro/can0_7"], heading, "heading_deg") < 1e-6
    assert np.isnan(topics["/gyro/can0_9"].columns["heading_deg"]).sum() == 30


def test_a_receiver_that_has_lost_its_fix_is_blank(tmp_path):
    lines = []
    for t in SECONDS:
        word = "Estimated (DR) mode" if 20 <= t < 30 else "GNSS Fix"
        lines += [delta(t, {"navigation.gnss.methodQuality": word}), ship(t)]
    topics, found = read(tmp_path, lines)
    assert np.isnan(topics["/gnss/fix"].columns["latitude"]).nonzero()[0].tolist() == [
        *range(20, 30)
    ]
    assert kinds(found) == ["status"]


def test_a_line_that_is_cut_is_damaged_and_nothing_else_is_lost(tmp_path):
    lines = [ship(t) for t in SECONDS]
    lines[20] = lines[20][:200]
    (tmp_path / "a.log").write_text("\n".join(lines))
    done = convert([tmp_path / "a.log"], None, tmp_path)
    assert "1 damaged" in done.lost[str(tmp_path / "a.log")] and len(done.logs) == 1


def test_a_log_without_the_ship_says_what_it_has(tmp_path):
    n2k = f"1717236000000;A;{iso(0)},2,127250,2,255,8,00,f7,04,ff,7f,ff,ff,ff"
    with pytest.raises(
        ChannelMissing, match=r"1 lines of NMEA 2000 are not read, .* 127250 heading"
    ):
        read(tmp_path, [n2k, f"1717236000000;I;{delta(0, {'tanks.fuel.0.level': 0.5})}"])


def test_other_texts_are_no_signal_k_log(tmp_path):
    for k, text in enumerate(("1617969600000;A;3.5\n" * 9, "time,x\n1,2\n", rmc(0) + "\n", "")):
        (tmp_path / f"{k}.log").write_text(text)
        assert not is_signalk(tmp_path / f"{k}.log")
