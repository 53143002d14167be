"""When each sentence was measured: headings at the times of a motion that is known."""

import numpy as np
import pytest
from made_nmea import (
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
    rudder,
    seconds,
    sentence,
    utc,
    when,
)

GRID = np.arange(0.0, 120.0, 0.1).round(3)


def burst_log(read_every, heading_every, rmc_every=1.0, offset=0.01, seconds=60.0, digits=3):
    """A recorder that reads its buffer every so often: all that came since has one stamp."""
    lines, waiting = [], []
    steps = round(read_every / 0.1)
    for k, t in enumerate(GRID[seconds > GRID].tolist()):
        if k % round(rmc_every / 0.1) == 0:
            waiting += [gga(t), rmc(t)]
        if k % round(heading_every / 0.1) == 0:
            waiting += [hdt(t), rsa(t)]
        if k % steps == steps - 1:
            stamp = when(t + offset, "%Y-%m-%dT%H:%M:%S.%f")
            stamp = stamp[: 20 + digits] if digits else stamp[:19]
            lines += [f"{stamp}Z {one}" for one in waiting]
            waiting = []
    return lines


@pytest.mark.parametrize(
    ("read_every", "heading_every", "offset"),
    [(0.5, 0.1, 0.01), (0.3, 0.1, 0.02), (1.0, 0.2, 0.01), (2.0, 0.1, 0.03), (0.5, 0.1, 3.0),
     (0.4, 0.1, -7.3)],
)  # fmt: skip
def test_a_burst_is_spread_over_the_time_since_the_one_before(
    tmp_path, read_every, heading_every, offset
):
    """10 Hz or 5 Hz headings under one stamp; the recorder may be seconds off as well."""
    topics, found = read(tmp_path, burst_log(read_every, heading_every, offset=offset))
    gyro = topics["/gyro"]
    assert len(gyro.time) == len(np.unique(gyro.time)) == round(60 / heading_every)
    worst = 2 * np.pi * heading_every  # deg/s times a period
    assert late(gyro, heading, "heading_deg") < worst
    assert late(topics["/rudder/main"], rudder, "angle_deg") < worst
    assert "burst" in kinds(found)


def test_stamps_in_whole_seconds_are_spread_over_that_second(tmp_path):
    """A logger that cuts its stamps: five headings bear each one."""
    lines = [f"{iso(t)[:19]}Z {hdt(t)}" for t in GRID[::2].tolist()]
    topics, _ = read(tmp_path, lines)
    assert len(topics["/gyro"].time) == len(np.unique(topics["/gyro"].time)) == len(GRID[::2])
    assert late(topics["/gyro"], heading, "heading_deg") < 2 * np.pi * 0.2


def test_different_sentences_of_one_burst_keep_the_epoch_of_its_utc(tmp_path):
    """The stamp of a burst is 0.35 s late, of each line a few microseconds more."""
    lines = []
    for t in GRID[::10].tolist():
        stamps = [when(t + 0.35 + k * 4e-5, "%Y-%m-%d %H:%M:%S.%f") for k in range(4)]
        lines += [f"{s} {b}" for s, b in zip(stamps, (hdt(t), gga(t), rmc(t), rsa(t)), strict=True)]
    topics, found = read(tmp_path, lines)
    assert late(topics["/gyro"], heading, "heading_deg") < 1e-3
    assert late(topics["/rudder/main"], rudder, "angle_deg") < 1e-3
    assert kinds(found) == []


def serial(offset, latency=0.1, period=1.0, headings=0.5, seconds=120.0, apart=0.07):
    """Lines as they come over a wire, stamped by a clock that is `offset(t)` ahead; RMC comes
    `apart` after GGA [s]."""
    lines = []
    for t in np.arange(0.0, seconds, 0.1).round(3).tolist():
        if round(t / 0.1) % round(period / 0.1) == 0:
            lines += [(t + latency, gga(t)), (t + latency + apart, rmc(t))]
        if round(t / 0.1) % round(headings / 0.1) == 0:
            lines += [(t + 0.02, hdt(t)), (t + 0.05, rsa(t))]
    return [f"{iso(t + offset(t))} {body}" for t, body in sorted(lines)]


@pytest.mark.parametrize(
    ("before", "after", "at"), [(-2.5, 0.03, 70), (1.2, -0.8, 40), (0.0, -3.0, 60), (5.0, 0.0, 90)]
)
def test_a_recorder_whose_clock_is_set_while_it_records(tmp_path, before, after, at):
    topics, found = read(tmp_path, serial(lambda t: before if t < at else after))
    assert late(topics["/gyro"], heading, "heading_deg") < 2 * np.pi * 0.15
    assert len(topics["/gyro"].time) == 240
    (said,) = [f for f in found.findings if f.kind == "jump"]
    assert "was set while it recorded" in said.sentence


@pytest.mark.parametrize(
    ("latency", "headings"), [(0.8, 0.1), (0.8, 1.0), (0.6, 0.5), (1.1, 0.2), (0.3, 0.1)]
)
def test_the_latency_of_a_receiver_is_not_the_recorder_s(tmp_path, latency, headings):
    topics, found = read(tmp_path, serial(lambda t: 0.0, latency, headings=headings))
    assert late(topics["/gyro"], heading, "heading_deg") < 2 * np.pi * 0.03
    said = [f for f in found.findings if f.kind == "clock_offset"]
    assert len(said) == (latency > 0.5)
    assert all(f.value == pytest.approx(latency, abs=0.05) for f in said)


@pytest.mark.parametrize("apart", [0.07, 0.6])  # each sentence has a latency of its own
def test_a_recorder_whose_clock_is_set_twice(tmp_path, apart):
    offset = serial(lambda t: -4.0 if t < 30 else 0.0 if t < 80 else 5.0, apart=apart)
    topics, found = read(tmp_path, offset)
    assert late(topics["/gyro"], heading, "heading_deg") < 2 * np.pi * 0.15
    assert [f.kind for f in found.findings] == ["jump"]


SLOWER = {  # s, of the latency in the course of the log; whether it is long enough to be said
    "scatters": (lambda t, rng: rng.uniform(0.2, 0.9), True),
    "becomes longer": (lambda t, rng: 0.2 if t < 60 else 0.9, False),
    "becomes shorter": (lambda t, rng: 1.2 if t < 60 else rng.uniform(0.55, 0.6), True),
}


@pytest.mark.parametrize("which", SLOWER)
def test_latency_that_varies_is_latency(tmp_path, which):
    rng, lines = np.random.default_rng(1), []
    of, said = SLOWER[which]
    for t in range(120):
        late_by = of(t, rng)
        lines += [(t + late_by, gga(t)), (t + late_by + 0.07, rmc(t))]
        lines += [(t + 0.02, hdt(t)), (t + 0.52, hdt(t + 0.5))]
    topics, found = read(tmp_path, [f"{iso(t)} {body}" for t, body in sorted(lines)])
    assert late(topics["/gyro"], heading, "heading_deg") < 2 * np.pi * 0.03
    assert [f.kind for f in found.findings] == ["clock_offset"] * said


@pytest.mark.parametrize("offset", [7200.0, -3600.0, 19_800.0])
def test_a_recorder_that_keeps_the_time_of_a_zone(tmp_path, offset):
    topics, found = read(tmp_path, serial(lambda t: offset, latency=0.7))
    assert late(topics["/gyro"], heading, "heading_deg") < 2 * np.pi * 0.05
    assert f"{offset:+.2f} s" in " ".join(f.sentence for f in found.findings)


@pytest.mark.parametrize("offset", [-0.9, 4.0, -30.0, 11.4, 86_400.0 * 30 + 5])
def test_a_recorder_that_is_off_by_more_than_a_latency(tmp_path, offset):
    topics, _ = read(tmp_path, serial(lambda t: offset))
    assert late(topics["/gyro"], heading, "heading_deg") < 2 * np.pi * 0.15


def test_a_recorder_whose_clock_drifts(tmp_path):
    """200 ppm fast, as a cheap crystal in the cold: 0.72 s after an hour."""
    lines = serial(lambda t: 0.5 + 2e-4 * t, period=2.0, headings=2.0, seconds=3600.0)
    topics, found = read(tmp_path, lines)
    assert late(topics["/gyro"], heading, "heading_deg") < 2 * np.pi * 0.15
    assert "drift" in " ".join(f.sentence for f in found.findings)


def test_stamps_without_a_date_take_that_of_the_receiver(tmp_path):
    lines = [line[11:23] + line[24:] for line in serial(lambda t: 0.0)]
    topics, found = read(tmp_path, lines)
    assert late(topics["/gyro"], heading, "heading_deg") < 2 * np.pi * 0.05
    assert kinds(found) == []


PLACEHOLDERS = {
    "0 N 0 E": sentence("GPRMC,000000.00,A,0000.000,N,00000.000,E,0.0,0.0,050505,0.0,E"),
    "a place": sentence("GPRMC,000000.00,A,5000.000,N,00800.000,E,0.0,0.0,050505,0.0,E"),
    "ZDA": sentence("IIZDA,120000.00,01,01,1999,00,00"),
    "no fix": sentence("GPRMC,000000.00,V,,,,,,,060180,,,N"),
    "GGA": sentence("GPGGA,000000.00,0000.000,N,00000.000,E,1,04,2.0,0.0,M,0.0,M,,"),
}


@pytest.mark.parametrize("which", PLACEHOLDERS)
def test_a_placeholder_moves_no_clock(tmp_path, which):
    lines = []
    for t in GRID[::10].tolist():
        lines += [PLACEHOLDERS[which], gga(t), rmc(t), hdt(t), rsa(t)]
    topics, _ = read(tmp_path, lines)
    assert seconds(topics["/gyro"]).tolist() == pytest.approx(GRID[::10].tolist(), abs=1e-6)
    for topic in ("/gnss/fix", "/gnss/velocity"):
        known = np.isfinite(next(iter(topics[topic].columns.values())))
        assert seconds(topics[topic])[known] == pytest.approx(GRID[::10], abs=1e-6)
        assert known.sum() == 120


def test_a_date_that_is_wrong_once_moves_no_clock(tmp_path):
    lines = []
    for t in GRID[::10].tolist():
        lines += [gga(t), rmc(t, date="010199" if t == 37.0 else None), hdt(t)]
    topics, found = read(tmp_path, lines)
    assert seconds(topics["/gyro"]) == pytest.approx(GRID[::10], abs=1e-6)
    assert seconds(topics["/gnss/velocity"]) == pytest.approx(GRID[::10], abs=1e-6)
    assert kinds(found) == []


@pytest.mark.parametrize(("step", "of"), [(10.0, "tens"), (1.0, "ones")])
def test_utc_that_counts_in_whole_or_tens_of_seconds(tmp_path, step, of):
    """Five fixes bear each UTC; they lie evenly in its step."""
    lines = []
    for t in np.arange(0.0, 100.0, step / 5).round(3).tolist():
        stamp = utc(t // step * step, 0)
        lines += [rmc(t, stamp=stamp), hdt(t)]
    topics, _ = read(tmp_path, lines)
    assert seconds(topics["/gnss/fix"]) == pytest.approx(np.arange(0, 100, step / 5), abs=1e-6)
    assert late(topics["/gyro"], heading, "heading_deg") < 1e-3


def test_sentences_that_come_twice_are_used_once(tmp_path):
    """Two links to one multiplexer."""
    lines = [line for t in GRID[::10].tolist() for line in (rmc(t), rmc(t), hdt(t))]
    topics, found = read(tmp_path, lines)
    assert seconds(topics["/gnss/fix"]) == pytest.approx(GRID[::10], abs=1e-6)
    assert kinds(found) == ["duplicate"]


def test_a_receiver_without_a_fix_keeps_time(tmp_path):
    """40 s without satellites: RMC is void, its clock runs on, the headings are where they were."""
    lines = []
    for t in GRID[::10].tolist():
        lost = 40 <= t < 80
        at, status = (",,,", "V") if lost else (None, "A")
        lines += [rmc(t, at=at, status=status, mode="N" if lost else "A")]
        lines += [hdt(t + k / 10) for k in (range(5) if lost else range(10))]
    topics, found = read(tmp_path, lines)
    assert late(topics["/gyro"], heading, "heading_deg") < 2 * np.pi * 0.5
    fix = topics["/gnss/fix"]
    assert seconds(fix) == pytest.approx(GRID[::10], abs=1e-6)
    blank = np.isnan(fix.columns["latitude"])
    assert (seconds(fix)[blank].min(), seconds(fix)[blank].max()) == pytest.approx((40.0, 79.0))
    assert kinds(found) == ["status", "status"]


@pytest.mark.parametrize(
    "form", ["{iso} {s}", "{unix:.3f} {s}", "{ms};N;{s}", "[{iso}] <{s}>", "{s},{iso}",
             "\\s:GP0001,c:{whole}*1A\\{s}", "gyr1 {day} {s}", "{local} UTC {s}"],
)  # fmt: skip
def test_what_loggers_write_before_a_sentence(tmp_path, form):
    """ISO, Unix seconds and ms, a tag block (NMEA 0183 4.0), the day of the year (Lamont)."""
    from made_nmea import START

    lines = []
    for t in range(60):
        local = when(t, "%Y-%m-%d %H:%M:%S.%f")[:-3]
        lines.append(form.format(
            iso=iso(t), unix=START + t, ms=round((START + t) * 1000), whole=round(START + t),
            day=when(t, "%Y:%j:%H:%M:%S.%f"), local=local, s=hdt(t),
        ))  # fmt: skip
    topics, _ = read(tmp_path, lines)
    assert seconds(topics["/gyro"]) == pytest.approx(np.arange(60), abs=2e-3)


def test_a_week_counter_that_rolled_over_is_put_right_by_the_stamps(tmp_path):
    """Its dates are 1024 weeks back: 2004-10-16 for 2024-06-01."""
    lines = [f"{iso(t + 0.1)} {rmc(t, date='161004')}" for t in range(60)]
    topics, found = read(tmp_path, lines)
    assert seconds(topics["/gnss/fix"]) == pytest.approx(np.arange(60), abs=1e-6)
    assert "1024 weeks" in found.findings[0].sentence


def test_headings_before_the_first_time_are_counted(tmp_path):
    lines = [hdt(0.0) for _ in range(50)] + [b for t in range(60) for b in (rmc(t), hdt(t))]
    topics, found = read(tmp_path, lines)
    assert len(topics["/gyro"].time) == 60
    assert [(f.kind, f.value) for f in found.findings] == [("dropped", 50.0)]


def test_places_are_as_they_were_sent():
    assert place(0.0) == "5400.0000000,N,01000.0000000,E"
