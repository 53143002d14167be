"""Which receiver, talker or instrument a sentence is of; and sound logs, that are of one each."""

import numpy as np
import pytest
from made_nmea import (
    METRES,
    gga,
    hdt,
    heading,
    iso,
    kinds,
    late,
    place,
    read,
    rmc,
    rsa,
    seconds,
    sentence,
    utc,
    when,
    where,
)

from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion.nmea import is_nmea
from shiplog.logs.conversion.nmea_folder import read_folder

SECONDS = range(120)


def off(fix, north=0.0, east=0.0) -> float:
    """The largest distance [m] of a topic's fixes from an antenna's place."""
    true = np.array([where(t, north, east) for t in seconds(fix).tolist()])
    found = np.stack((fix.columns["latitude"], fix.columns["longitude"]), axis=1)
    return float(np.nanmax(np.abs(found - true).max(axis=1)) * METRES)


def aft(t, metres=12.0):
    return place(t, -metres, 0.0)


def alternate(t):
    """Each once a second, half a second apart."""
    return [gga(t), rmc(t), gga(t + 0.5, at=aft(t + 0.5)), rmc(t + 0.5, at=aft(t + 0.5))]


def same_time(t):
    """Both at each whole second."""
    return [gga(t), rmc(t), gga(t, at=aft(t)), rmc(t, at=aft(t))]


def rhythms(t):
    """One at 1 Hz, the other at 5 Hz."""
    fast = [gga(t + k / 5, at=aft(t + k / 5)) for k in range(5)]
    return [rmc(t), gga(t), *fast]


def forms(t):
    """An old one writes fewer digits, at a rhythm that is not quite the other's."""
    if t % 10 == 3:
        return [gga(t), rmc(t)]
    u = t + 0.4 + t % 10 * 0.05
    u = round(u - u % 0.1, 1)
    old = sentence(f"GPGGA,{utc(u, 1)},{aft(u)},1,8,1.0,3.0,M,,M,,")
    return [gga(t), rmc(t), old]


@pytest.mark.parametrize("how", [alternate, same_time, rhythms, forms])
def test_two_receivers_under_one_talker_are_two(tmp_path, how):
    lines = [line for t in SECONDS for line in [*how(float(t)), hdt(float(t))]]
    topics, found = read(tmp_path, lines)
    fixes = {name: one for name, one in topics.items() if name.startswith("/gnss/fix")}
    assert sorted(fixes) == ["/gnss/fix", "/gnss/fix/gp_2"]
    apart = sorted(off(one) for one in fixes.values())
    assert apart[0] < 0.02 and 11.9 < apart[1] < 12.1
    assert min(off(one, -12.0) for one in fixes.values()) < 0.02
    assert kinds(found) == ["two_sources"]
    assert "/gyro" in topics and late(topics["/gyro"], heading, "heading_deg") < 2 * np.pi * 1.0


@pytest.mark.parametrize("back", ["161004", "010300"])
def test_a_receiver_of_another_date_is_another_one(tmp_path, back):
    """1024 weeks back, or never set: the headings are dated by neither of them but the other."""
    lines = []
    for t in SECONDS:
        lines += [rmc(t), hdt(t), rmc(t, date=back, at=aft(t))]
    topics, found = read(tmp_path, lines)
    assert off(topics["/gnss/fix"]) < 0.02
    assert off(topics["/gnss/fix/gp_2"], -12.0) < 0.02  # its time was put right
    assert seconds(topics["/gyro"]) == pytest.approx(np.arange(120), abs=1e-6)
    assert kinds(found) == ["two_sources", "clock_offset"]
    assert ("1024 weeks" in found.findings[1].sentence) == (back == "161004")


def test_a_receiver_that_sends_gps_time_is_named(tmp_path):
    lines = []
    for t in SECONDS:
        lines += [
            rmc(t),
            hdt(t),
            rmc(t + 18.0, talker="GN", date=when(t + 18, "%d%m%y"), at=aft(t)),
        ]
    topics, found = read(tmp_path, lines)
    assert {"/gnss/fix/gp", "/gnss/fix/gn"} <= set(topics)
    (said,) = [f for f in found.findings if f.kind == "clock_offset"]
    assert abs(said.value) == pytest.approx(18.0, abs=0.1) and "GPS time" in said.sentence


def test_sentences_of_two_receivers_that_share_a_time_are_said(tmp_path):
    """One sends GGA, the other RMC: positions and velocities of two antennas."""
    lines = [line for t in SECONDS for line in (gga(t), rmc(t, at=aft(t)), hdt(t))]
    _, found = read(tmp_path, lines)
    (said,) = found.findings
    assert said.kind == "two_sources" and said.value == pytest.approx(12.0, abs=0.1)


@pytest.mark.parametrize(
    "talker",
    [lambda t: "GP" if t < 25 else "GN", lambda t: ("GP", "GN")[t // 20 % 2],
     lambda t: "GI" if t % 43 == 17 else "GP" if t % 29 == 5 else "II"],
    ids=["once", "back and forth", "now and then"],
)  # fmt: skip
def test_one_receiver_under_several_talkers_is_one(tmp_path, talker):
    lines = [b for t in SECONDS for b in (gga(t, talker(t)), rmc(t, talker(t)), hdt(t))]
    topics, found = read(tmp_path, lines)
    assert sorted(topics) == ["/gnss/fix", "/gnss/velocity", "/gyro"]
    assert seconds(topics["/gnss/fix"]) == pytest.approx(np.arange(120), abs=1e-6)
    assert kinds(found) == []


def test_two_gyros_are_two(tmp_path):
    lines = [b for t in SECONDS for b in (rmc(t), hdt(t), hdt(t + 0.0, talker="II"))]
    topics, _ = read(tmp_path, lines)
    assert {"/gyro/he", "/gyro/ii"} <= set(topics) and "/gyro" not in topics


def test_two_receivers_that_the_recorder_names(tmp_path):
    lines = []
    for t in SECONDS:
        lines += [f"seap {iso(t)} {rmc(t)}", f"pcod {iso(t + 0.3)} {rmc(t, at=aft(t))}"]
        lines.append(f"gyr1 {iso(t)} {hdt(t)}")
    topics, _ = read(tmp_path, lines)
    assert off(topics["/gnss/fix/seap"]) < 0.02 and off(topics["/gnss/fix/pcod"], -12.0) < 0.02
    assert "/gyro" in topics


def coarse(t):
    """Positions in 0.001 min: 1.9 m north, 1.1 m east."""
    latitude, longitude = where(t)
    return f"{int(latitude):02d}{latitude % 1 * 60:06.3f},N,{int(longitude):03d}" + (
        f"{longitude % 1 * 60:06.3f},E"
    )


SOUND = {
    "10 Hz": lambda t: [gga(t + k / 10) for k in range(10)] + [rmc(t)],
    "5 Hz and 1 Hz": lambda t: [rmc(t), *(gga(t + k / 5) for k in range(5))],
    "coarse": lambda t: [gga(t + k / 5, at=coarse(t + k / 5)) for k in range(5)] + [rmc(t)],
    "held": lambda t: [gga(t + k / 10, at=place(t + k // 2 / 5)) for k in range(10)] + [rmc(t)],
    "moored": lambda t: [gga(t, at=place(0.0)), rmc(t, at=place(0.0))],
    "GGA only now and then": lambda t: [rmc(t)] + ([gga(t)] if t % 10 == 0 else []),
    "GNSS sentences of all kinds": lambda t: [
        gga(t, "GN"), rmc(t, "GN"), sentence("GPGSV,1,1,01,02,10,039,40"),
        sentence("GLGSV,1,1,01,66,10,039,40"), sentence("GNGSA,A,3,02,,,,,,,,,,,,2.1,1.1,1.7"),
    ],
}  # fmt: skip


@pytest.mark.parametrize("which", SOUND)
def test_a_sound_log_is_of_one_receiver_and_nothing_is_said(tmp_path, which):
    lines = [line for t in SECONDS for line in [*SOUND[which](float(t)), hdt(float(t))]]
    topics, found = read(tmp_path, lines)
    assert {"/gnss/fix", "/gnss/velocity", "/gyro"} == set(topics)
    assert kinds(found) == []


def test_a_receiver_with_noise_is_one(tmp_path):
    rng = np.random.default_rng(1)
    lines = []
    for k in range(600):
        north, east = rng.normal(0, 2.0, 2)
        lines += [gga(k / 5, at=place(k / 5, north, east)), hdt(k / 5)]
    lines.insert(0, rmc(0.0))
    topics, found = read(tmp_path, lines)
    assert set(topics) == {"/gnss/fix", "/gnss/velocity", "/gyro"} and kinds(found) == []


CUTS = {
    "a number": lambda s, t: s[: s.index("*") - 3],
    "its checksum": lambda s, t: s[: s.index("*")],
    "into the next one": lambda s, t: s[:9] + rsa(t),
    "half of its checksum": lambda s, t: s[:-1],
    "its beginning": lambda s, t: s[7:],
    "a byte": lambda s, t: s[:8] + s[9:],
}


@pytest.mark.parametrize("how", CUTS)
def test_where_a_talker_sends_checksums_what_is_cut_is_damaged(tmp_path, how):
    lines = []
    for t in SECONDS:
        one = hdt(t)
        lines += [rmc(t), CUTS[how](one, t) if t % 40 == 13 else one, rsa(t)]
    topics, found = read(tmp_path, lines)
    assert late(topics["/gyro"], heading, "heading_deg") < 1e-3
    assert len(topics["/gyro"].time) == 117
    assert found.damaged == 3 and kinds(found) == ["dropped"]


def test_a_device_that_sends_no_checksums_is_whole(tmp_path):
    """Also next to one that does, and under the same letters."""
    bare = [line.split("*")[0] for line in (sentence(f"IIVHW,,T,,M,{t}.0,N,,K") for t in SECONDS)]
    lines = [b for t in SECONDS for b in (rmc(t), hdt(t, "II"), bare[t], rsa(t).split("*")[0])]
    topics, found = read(tmp_path, lines)
    assert found.damaged == 0
    assert len(topics["/rudder/main"].time) == len(topics["/speed/water"].time) == 120


@pytest.mark.parametrize("form", [lambda s: s + "<0x0D>", lambda s: s + "  ", lambda s: s + ",x"])
def test_what_follows_a_checksum_is_no_damage(tmp_path, form):
    lines = [form(b) for t in SECONDS for b in (rmc(t), hdt(t))]
    assert read(tmp_path, lines)[1].damaged == 0


def test_a_checksum_without_its_leading_zero(tmp_path):
    whole = [sentence(f"TIROT,{t / 7:.3f},A") for t in SECONDS]
    short = [b[:-2] + b[-1] for b in whole if b[-2] == "0"]
    assert short
    topics, found = read(tmp_path, [*(rmc(t) for t in SECONDS), *short])
    assert found.damaged == 0 and len(topics["/gyro/rate"].time) == len(short)
    wrong = [b[:-1] + ("1" if b[-1] != "1" else "2") for b in short]
    assert read(tmp_path, [*(rmc(t) for t in SECONDS), *wrong])[1].damaged == len(short)


def test_talkers_with_digits_and_one_that_was_renamed(tmp_path):
    """n2kd names the source; a multiplexer writes another talker and leaves the checksum."""
    lines = [b for t in SECONDS for b in (rmc(t).replace("$GP", "$12"), hdt(t, "24"))]
    topics, found = read(tmp_path, lines)
    assert found.damaged == 0 and set(topics) == {"/gnss/fix", "/gnss/velocity", "/gyro"}
    assert "wrong, all in the same bits" in found.findings[0].sentence


def test_what_is_all_simulated_says_so(tmp_path):
    lines = [rmc(t, mode="S") for t in SECONDS]
    with pytest.raises(ChannelMissing, match="simulator"):
        read(tmp_path, lines)


def test_a_status_is_blank_and_said_with_its_times(tmp_path):
    lines = []
    for t in SECONDS:
        bad = 30 <= t < 50
        lines += [gga(t, quality=8 if bad else 1), rmc(t, mode="S" if bad else "D"), hdt(t)]
    topics, found = read(tmp_path, lines)
    blank = np.isnan(topics["/gnss/fix"].columns["latitude"])
    assert blank.sum() == 20 and len(blank) == 120
    fix, velocity = found.findings
    assert (fix.kind, fix.channel, fix.start_s, fix.end_s) == ("status", "/gnss/fix", 30.0, 49.0)
    assert velocity.channel == "/gnss/velocity" and "simulator" in fix.sentence


def test_a_folder_of_one_text_an_instrument_is_one_log(tmp_path):
    """As research ships record: names without endings, a file an instrument and day."""
    for name, lines in {
        "NBP_seap-2024-06-01": [f"{iso(t + 0.1)} {rmc(t)}" for t in SECONDS],
        "NBP_gyr1-2024-06-01.d153": [f"{iso(t)} {hdt(t)}" for t in range(60)],
        "NBP_gyr1-2024-06-01b.d153": [f"{iso(t)} {hdt(t)}" for t in range(60, 120)],
        "NBP_rudd.log": [f"{iso(t)} {rsa(t)}" for t in SECONDS],
    }.items():
        (tmp_path / name).write_text("\n".join(lines))
        assert is_nmea(tmp_path / name)
    found = read_folder(tmp_path, None)
    topics = {one.topic: one for one in found.series}
    assert sorted(topics) == ["/gnss/fix", "/gnss/velocity", "/gyro", "/rudder/main"]
    assert len(topics["/gyro"].time) == 120 and found.left_out == []
    assert late(topics["/gyro"], heading, "heading_deg") < 1e-3


def test_a_text_of_a_folder_that_has_no_time_is_said(tmp_path):
    (tmp_path / "gps.nmea").write_text("\n".join(rmc(t) for t in SECONDS))
    (tmp_path / "gyro.nmea").write_text("\n".join(hdt(t) for t in SECONDS))
    (tmp_path / "wind.csv").write_text("time,speed_mps\n" + "\n".join(
        f"{1_717_236_000 + t},5.0" for t in SECONDS))  # fmt: skip
    found = read_folder(tmp_path, None)
    assert {"/gnss/fix", "/gnss/velocity", "/wind"} == {one.topic for one in found.series}
    assert len(found.left_out) == 1 and "gyro.nmea has no time" in found.left_out[0]


def test_the_days_of_one_receiver_go_on(tmp_path):
    for day in range(2):
        lines = [rmc(day * 3600.0 + t) for t in SECONDS]
        (tmp_path / f"day{day}.nmea").write_text("\n".join(lines))
    found = read_folder(tmp_path, None)
    assert {one.topic: len(one.time) for one in found.series} == {
        "/gnss/fix": 240, "/gnss/velocity": 240,
    }  # fmt: skip


def test_damage_costs_what_it_hits_and_moves_no_heading(tmp_path):
    """A serial line that loses, cuts and garbles bytes: a heading is a heading of its second."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        raw = bytearray(
            "\n".join(b for t in range(40) for b in (gga(t), rmc(t), hdt(t), rsa(t))).encode()
        )
        for _ in range(8):
            at = int(rng.integers(len(raw)))
            if rng.random() < 0.5:
                del raw[at : at + int(rng.integers(1, 40))]
            else:
                raw[at] = int(rng.integers(256))
        topics, found = read(tmp_path, raw.decode("latin-1").split("\n"))
        assert late(topics["/gyro"], heading, "heading_deg") < 2 * np.pi * 1.01
        assert len(topics["/gyro"].time) > 25 and found.damaged > 0


def test_a_receive_stamp_with_a_damaged_digit_moves_no_heading(tmp_path):
    lines = [f"{iso(t)} {hdt(t)}" for t in SECONDS]
    lines[50] = lines[50].replace("T10:00:5", "T10:07:5")
    topics, _ = read(tmp_path, lines)
    assert late(topics["/gyro"], heading, "heading_deg") < 1e-3
