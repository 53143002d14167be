"""Between samples: what holds, what is a straight line, and what is too far apart to be either."""

from dataclasses import replace

import numpy as np
import pytest
import sailing

from shiplog.exceptions import ProfileError
from shiplog.logs.conversion.write import Series
from shiplog.nomenclature.channels import UNUSABLE
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.rows import resampling, stamp_steps

SECOND = 1_000_000_000
ORDERS = ((0.0, 0.0), (12.0, 10.0), (31.0, -15.0), (34.0, 0.0), (80.0, 20.0), (92.0, 5.0))


@pytest.fixture
def voyage(tmp_path):
    def build(parts, text=sailing.PROFILE):
        return ingest(sailing.write(tmp_path / "turn.mcap", parts), sailing.profile(text))

    return build


def rudder_of(time_s, angle_deg):
    """The circle of 120 s with other rudder angles; the profile turns their sign."""
    parts = sailing.series(120.0)
    t = sailing.stamps(np.asarray(time_s, float))
    return {**parts, "/rudder": Series("/rudder", "test.Rudder", t, {"angle_deg": -np.asarray(
        angle_deg, float)})}  # fmt: skip


def between(how, more=""):
    return sailing.PROFILE.replace(
        'topic = "/rudder"', f'topic = "/rudder"\nbetween = "{how}"\n{more}'
    )


def ordered_at(t):
    at = np.searchsorted([when for when, _ in ORDERS], t + 1e-6, side="right") - 1
    return np.array([angle for _, angle in ORDERS])[at]


def usable(done):
    return (done.table["quality"].to_numpy() & int(UNUSABLE)) == 0


def seconds_of(done):
    return (done.table["time"].to_physical().to_numpy() - sailing.START) * 1e-9


@pytest.mark.parametrize("text", [sailing.PROFILE, between("hold")], ids=["unsaid", "hold"])
def test_an_order_that_is_sent_when_it_changes_holds(voyage, text):
    done = voyage(rudder_of(*zip(*ORDERS, strict=True)), text)
    assert usable(done).all()
    t = seconds_of(done)
    assert np.degrees(done.table["rudder"].to_numpy()) == pytest.approx(ordered_at(t), abs=1e-9)
    said = [f for f in done.report.findings if f.channel == "rudder"]
    assert [f.kind for f in said] == ([] if text != sailing.PROFILE else ["held"])
    if said:
        assert 'between = "hold"' in said[0].sentence and "[[actuators]]" in said[0].sentence


def test_where_the_profile_says_line_nothing_stands_between_orders_far_apart(voyage):
    done = voyage(rudder_of(*zip(*ORDERS, strict=True)), between("line"))
    t, angle = seconds_of(done), np.degrees(done.table["rudder"].to_numpy())
    far = (t > 34.1) & (t < 79.9)
    assert np.isnan(angle.astype(float)[far]).all() and not usable(done)[far].any()


def test_before_the_first_order_there_is_none_and_a_blank_ends_one(voyage):
    times = [20.0, 50.0, 70.0, 90.0]
    done = voyage(rudder_of(times, [10.0, np.nan, 5.0, -5.0]), between("hold"))
    t, angle = seconds_of(done), np.degrees(done.table["rudder"].to_numpy().astype(float))
    known = ((t >= 20.0) & (t < 49.95)) | (t >= 69.95)
    assert (np.isfinite(angle) == known).all() and (usable(done) == known).all()
    assert angle[(t > 20) & (t < 49.9)] == pytest.approx(10.0)
    assert angle[-1] == pytest.approx(-5.0)  # to the end of the voyage


def test_a_held_value_ends_where_the_tolerance_is_over(voyage):
    done = voyage(rudder_of([0.0, 60.0], [10.0, 5.0]), between("hold", "tolerance_s = 20.0"))
    t, angle = seconds_of(done), np.degrees(done.table["rudder"].to_numpy().astype(float))
    known = (t <= 20.0 + 1e-6) | ((t >= 60.0 - 1e-6) & (t <= 80.0 + 1e-6))
    assert (np.isfinite(angle) == known).all()


def test_angles_that_were_measured_and_come_rarely_are_asked_for(voyage):
    """With noise, at odd times: it may be an order, and may be a radio that fails."""
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(1.0, 14.0, 15))
    times = times[times < 118.0]
    done = voyage(rudder_of(times, rng.normal(0.0, 8.0, len(times))))
    (finding,) = [f for f in done.report.findings if f.channel == "rudder" and f.kind != "blank"]
    assert finding.kind == "gap" and 'set between = "hold"' in finding.sentence
    wide = np.diff(times) > 5.0
    t = seconds_of(done)
    for begin, end in zip(times[:-1][wide], times[1:][wide], strict=True):
        inside = (t > begin + 0.1) & (t < end - 0.1)
        assert not usable(done)[inside].any()


@pytest.mark.parametrize(
    ("hz", "jitter"),  # in periods
    [(1, 0.0), (1, 0.3), (2, 0.05), (5, 0.3), (10, 0.0), (10, 0.05), (50, 0.3)],
)
def test_a_rudder_that_is_measured_all_the_time_is_no_order(voyage, hz, jitter):
    rng = np.random.default_rng(hz)
    t = np.sort(np.arange(0.0, 120.0, 1 / hz) + rng.normal(0.0, jitter / hz, 120 * hz)).clip(0.0)
    t = t[(t < 40.0) | (t > 55.0)]  # the radio failed
    done = voyage(rudder_of(t, np.round(15.0 * np.sin(0.7 * t), 1)))
    assert not [f for f in done.report.findings if f.kind in ("held", "burst", "dropped")]
    assert not usable(done)[(seconds_of(done) > 41.5) & (seconds_of(done) < 53.5)].any()


@pytest.mark.parametrize("name", ["position", "velocity", "heading", "yaw_rate"])
def test_a_motion_does_not_hold(name):
    text = sailing.PROFILE.replace(f"[sensors.{name}]", f'[sensors.{name}]\nbetween = "hold"')
    with pytest.raises(ProfileError, match=f"sensors.{name}.* between"):
        sailing.profile(text)


@pytest.mark.parametrize(("every", "seconds"), [(8.0, 120.0), (30.0, 300.0), (430.0, 900.0)])
def test_samples_too_far_apart_give_no_row_and_one_sentence(voyage, every, seconds):
    parts = sailing.series(seconds)
    one = parts["/position"]
    rare = np.arange(0, len(one.time), int(every * 10))
    columns = {name: v[rare] for name, v in one.columns.items()}
    parts["/position"] = Series(one.topic, one.schema, one.time[rare], columns)
    done = voyage(parts)
    assert done.report.usable_s == 0
    (finding,) = [f for f in done.report.findings if f.channel == "position"]
    assert (finding.kind, finding.value) == ("gap", pytest.approx(every))
    assert "tolerance_s in [sensors.position]" in finding.sentence
    allowed = sailing.PROFILE.replace(
        'topic = "/position"', f'topic = "/position"\ntolerance_s = {1.5 * every}'
    )
    assert (voyage(parts, allowed).report.usable_s or 0) > 0.45 * seconds


@pytest.mark.parametrize(("length", "longest"), [(3.0, 5.0), (10.0, 5.05), (330.0, 29.0)])
def test_a_longer_ship_bears_a_longer_time_between_samples(length, longest):
    """A ship at Fn = 0.2 goes its length in L / (0.2 sqrt(g L))."""
    assert resampling.longest_s(length) == pytest.approx(longest, abs=0.01)


def cut_off(seconds, step):
    return np.rint(np.floor(seconds / step + 1e-9) * step * SECOND).astype(np.int64)


@pytest.mark.parametrize(
    ("period", "step"),
    [(1.136, 1.0), (1.02, 1.0), (1.5, 1.0), (2.4, 1.0), (1.0, 0.864), (0.25, 0.1)],
)
def test_stamps_in_coarse_steps_are_recognised(period, step):
    found = stamp_steps.period_and_step(cut_off(np.arange(1500) * period, step))
    assert found == (pytest.approx(period, rel=0.01), pytest.approx(step))


@pytest.mark.parametrize("lost", [0.0, 0.001, 0.02, 0.1, 0.3])
@pytest.mark.parametrize("hz", [1, 5, 10])
def test_messages_that_are_lost_are_no_coarse_stamps(hz, lost):
    kept = np.random.default_rng(0).random(3000) >= lost
    time = np.rint(np.arange(3000)[kept] / hz * SECOND).astype(np.int64)
    assert stamp_steps.period_and_step(time) == (pytest.approx(1 / hz), 0.0)


def test_utc_in_whole_seconds_each_1_136_s_is_usable_and_said(voyage):
    parts = {}
    t = np.arange(0.0, 600.0, 1.136)
    for topic, one in sailing.series(600.0).items():
        true = (one.time - sailing.START) * 1e-9
        columns = {}
        for name, v in one.columns.items():
            turns = 360.0 if name in ("cog_deg", "heading_deg", "direction_deg") else None
            v = np.unwrap(v, period=turns) if turns else v
            columns[name] = np.interp(t, true, v) % turns if turns else np.interp(t, true, v)
        stamps = sailing.START + cut_off(t, 1.0)
        parts[topic] = Series(topic, one.schema, stamps, columns)
    done = voyage(parts)
    assert (done.report.usable_s or 0) > 500
    (finding,) = [f for f in done.report.findings if "count in steps of 1 s" in f.sentence]
    assert (finding.kind, finding.low, finding.high) == ("clock_offset", -1.0, 0.0)
    assert "tolerance_s" in finding.sentence


@pytest.mark.parametrize("every", [5, 10])
def test_headings_that_are_handed_over_in_bursts_keep_step(voyage, every):
    """One stamp for some of them, 10 ms after the last."""
    parts = sailing.series()
    one = parts["/gyro"]
    last = np.minimum((np.arange(len(one.time)) // every + 1) * every, len(one.time)) - 1
    stamps = one.time[last] + 10_000_000
    for spread in (0, 2_000_000):
        there = stamps + spread * (np.arange(len(one.time)) % every)
        done = voyage({**parts, "/gyro": Series("/gyro", one.schema, there, dict(one.columns))})
        assert usable(done).sum() > 570
        true = 3.0 + 0.04 * seconds_of(done)  # rad, and 0.04 rad/s
        turn = np.angle(np.exp(1j * (done.table["heading"].to_numpy() - true)))[usable(done)]
        assert np.abs(turn).max() < 0.04 * 0.031  # 10 ms, and what ten samples need
        (finding,) = [f for f in done.report.findings if f.kind == "burst"]
        assert "heading" in finding.sentence and finding.value == pytest.approx(0.1)


def test_two_instruments_under_one_name_are_counted_and_one_is_used(voyage):
    clean, parts = voyage(sailing.series()), sailing.series()
    one = parts["/position"]
    columns = {name: np.repeat(v, 2) for name, v in one.columns.items()}
    columns["x_m"][1::2] += 12.0  # the antenna at the stern
    done = voyage({**parts, "/position": Series(
        one.topic, one.schema, np.repeat(one.time, 2), columns)})  # fmt: skip
    (finding,) = [f for f in done.report.findings if f.kind == "dropped"]
    assert (finding.channel, finding.value) == ("position", len(one.time))
    assert done.table["x0"].to_list() == pytest.approx(clean.table["x0"].to_list())


@pytest.mark.parametrize(
    ("seconds", "shift"), [(60.0, 0.0), (60.0, 0.05), (60.9, 0.03), (61.4, 0.0), (61.4, 0.05)]
)
def test_usable_seconds_are_no_more_than_the_voyage_has(voyage, seconds, shift):
    parts = {
        topic: replace(one, time=one.time + int(shift * SECOND))
        for topic, one in sailing.series(seconds).items()
    }
    report = voyage(parts).report
    assert seconds - 2.0 <= (report.usable_s or 0) <= report.seconds


CLOCKS = {"clock_offset", "contradiction", "burst", "dropped", "wrapped", "restarted", "held"}


MIDNIGHT, AUTUMN, SPRING = 1_717_286_370, 1_729_990_770, 1_711_846_770  # Unix time, 30 s before


@pytest.mark.parametrize(
    ("hz", "jitter", "begin"),  # jitter in periods
    [(1, 0.0, AUTUMN), (1, 0.3, MIDNIGHT), (2, 0.1, SPRING), (2, 0.3, AUTUMN), (5, 0.0, MIDNIGHT),
     (5, 0.3, SPRING), (10, 0.0, SPRING), (10, 0.1, AUTUMN), (10, 0.3, MIDNIGHT),
     (50, 0.1, MIDNIGHT)],
)  # fmt: skip
def test_a_sound_voyage_has_nothing_to_be_said_of_its_clocks(voyage, hz, jitter, begin):
    """In UTC, over midnight, or when clocks are changed; with a pause of the whole log."""
    rng = np.random.default_rng(hz)
    parts = {}
    for topic, one in sailing.series(120.0).items():
        true = (one.time - sailing.START) * 1e-9
        t = np.arange(0.3, 119.0, 1 / hz)
        t = np.sort(t + rng.normal(0.0, jitter / hz, len(t)))
        t = t[(t < 60.0) | (t > 75.0)]
        columns = {}
        for name, v in one.columns.items():
            turns = 360.0 if name in ("cog_deg", "heading_deg", "direction_deg") else None
            whole = np.interp(t, true, np.unwrap(v, period=turns) if turns else v)
            columns[name] = whole % turns if turns else whole
        stamps = begin * SECOND + np.rint(t * 1000).astype(np.int64) * 1_000_000
        late = rng.integers(5_000_000, 60_000_000, len(t))
        parts[topic] = Series(topic, one.schema, stamps, columns, log_time=stamps + late)
    done = voyage(parts)
    assert not [f for f in done.report.findings if f.kind in CLOCKS]
    assert (done.report.usable_s or 0) > (90 if jitter < 0.3 or hz > 2 else 60)


@pytest.mark.parametrize("each", [7, 20, 50])
@pytest.mark.parametrize("hz", [1.0, 5.0])
def test_messages_that_are_lost_evenly_are_told_from_coarse_stamps_by_the_motion(each, hz):
    """Every so many seconds a sentence is cut; or UTC counts in steps of the median period. The
    stamps are the same; what the ship does in the long step is not."""
    count = 1500
    exact = np.arange(count) / hz
    kept = np.arange(count) % each != each // 2
    time = np.rint(exact[kept] * 1e9).astype(np.int64)
    lost = resampling.ordered(time, np.sin(exact[kept] * 0.05)[:, None], None)
    assert (lost.step_s, lost.period_s) == (0.0, pytest.approx(1 / hz))
    even = np.arange(len(time)) * np.ptp(time) * 1e-9 / (len(time) - 1)
    coarse = resampling.ordered(time, np.sin(even * 0.05)[:, None], None)
    assert coarse.step_s == pytest.approx(1 / hz)
    still = resampling.ordered(time, np.zeros((len(time), 1)), None)
    assert still.step_s == pytest.approx(1 / hz)
