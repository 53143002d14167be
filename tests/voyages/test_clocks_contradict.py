"""Clocks of one voyage that differ by more than a second: put on one scale, or no row is used."""

from dataclasses import replace

import numpy as np
import pytest
import sailing

from shiplog.exceptions import LogUnreadable
from shiplog.logs.conversion.write import Series
from shiplog.logs.health.leap_seconds import gps_utc_s, known_difference
from shiplog.nomenclature.channels import UNUSABLE
from shiplog.voyages.ingest import ingest as ingesting
from shiplog.voyages.ingest.ingest import ingest

SECOND = 1_000_000_000
GNSS, GYRO = ("/position", "/velocity"), ("/gyro",)
LATENCY = 20_000_000  # ns, from a stamp to its log time


@pytest.fixture
def voyage(tmp_path):
    def build(parts):
        return ingest(sailing.write(tmp_path / "turn.mcap", parts), sailing.profile())

    return build


def moved(seconds, topics, latency=LATENCY, late=None):
    """The circle with the stamps on some topics moved, and each logged some time after it was."""
    return {
        topic: replace(
            one,
            time=one.time + (np.int64(round(seconds * SECOND)) if topic in topics else 0),
            log_time=one.time + (late if late is not None and topic in topics else latency),
        )
        for topic, one in sailing.series().items()
    }


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    """The circle on one clock, ingested; nobody changes it."""
    folder = tmp_path_factory.mktemp("clean")
    return ingest(sailing.write(folder / "turn.mcap", sailing.series()), sailing.profile())


def usable(table):
    return (table["quality"].to_numpy() & int(UNUSABLE)) == 0


@pytest.mark.parametrize(
    ("seconds", "topics"),
    [(18.0, GNSS), (-18.0, GNSS), (18.0, GYRO), (37.0, GNSS), (-37.0, GYRO), (19.0, GNSS),
     (17.9, GYRO), (18.2, GNSS)],
)  # fmt: skip
def test_the_time_of_gps_and_tai_are_taken_out_and_named(voyage, clean, seconds, topics):
    done = voyage(moved(seconds, topics))
    known = float(np.copysign(round(abs(seconds)), seconds))
    (finding,) = [f for f in done.report.findings if "put onto the others' scale" in f.sentence]
    assert (finding.kind, finding.value) == ("clock_offset", known)
    assert ("GPS time" if abs(known) < 30 else "TAI") in finding.sentence
    assert all(topic in finding.sentence for topic in topics)
    assert usable(done.table).all()
    both = done.table.join(clean.table, on="time", suffix="_clean")
    within = 0.21 if abs(seconds) != abs(known) else 1e-9  # s of 0.8 m/s stay as they are
    assert float((both["x0"] - both["x0_clean"]).abs().max()) < within


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(3600.0, "1 whole hour as of a time zone"), (-7200.4, "2 whole hours as of a time zone"),
     (2.5, "2.5 s ahead of"), (-120.0, "120 s behind"), (14.0, "14 s ahead of")],
)  # fmt: skip
@pytest.mark.parametrize("topics", [GNSS, ("/rudder",)], ids=["gnss", "rudder"])
def test_another_difference_contradicts_and_no_row_is_usable(voyage, seconds, words, topics):
    done = voyage(moved(seconds, topics))
    (finding,) = done.report.contradictions
    assert (finding.reason, finding.unit) == ("clock", "s")
    assert finding.value == pytest.approx(seconds, abs=0.05)
    assert words in finding.sentence
    key = "[sensors.position]" if topics == GNSS else "[[actuators]] of rudder"
    assert key in finding.sentence and 'clock = "log"' in finding.sentence
    assert not usable(done.table).any()
    assert (done.report.usable_s, done.report.serious) == (0, True)
    assert not [f for f in done.report.findings if "no time in common" in f.sentence]


@pytest.mark.parametrize("late", [0.3, 0.8, 1.06, 1.4])
def test_messages_that_come_late_are_of_the_same_clock(voyage, clean, late):
    done = voyage(moved(0.0, GNSS, late=int(late * SECOND)))
    assert done.table.equals(clean.table)
    assert not done.report.contradictions


def test_a_recorder_that_wrote_a_replay_says_nothing_of_clocks(voyage):
    """A hundred times as fast: what came last seems to be hours behind."""
    parts = {
        topic: replace(one, log_time=sailing.START + (one.time - sailing.START) // 100)
        for topic, one in sailing.series().items()
    }
    done = voyage(parts)
    assert not done.report.contradictions and usable(done.table).all()


def test_check_says_what_ingest_says(tmp_path):
    from shiplog.logs.reading.read import read

    profile = sailing.profile()
    path = sailing.write(tmp_path / "turn.mcap", moved(3600.0, GNSS))
    found = ingesting.consistency_of(read(path, profile.wanted(), others=True), profile, {})
    assert [f.kind for f in found.findings][:1] == ["contradiction"]


@pytest.mark.parametrize(
    ("day", "seconds"),
    [("2024-06-01", 18), ("2017-01-01", 18), ("2016-12-31", 17), ("2015-06-30", 16),
     ("2012-06-30", 15), ("2008-01-01", 14), ("2001-01-01", 13)],
)  # fmt: skip
def test_leap_seconds_by_date(day, seconds):
    """IERS Bulletin C: TAI - UTC is 37 s since 2017, 36, 35, 34, 33 and 32 s before."""
    instant = float(np.datetime64(day, "ns").astype(np.int64))
    assert gps_utc_s(instant) == seconds
    assert known_difference(seconds + 0.2, instant)[0] == seconds
    assert known_difference(-seconds - 19.0, instant)[0] == -seconds - 19.0
    assert known_difference(seconds + 0.5, instant) == (0.0, "")


def after(one, at_s, by_s, what):
    """A topic whose stamps, or log times, are `by_s` further from a moment on."""
    add = np.where(one.time - sailing.START >= at_s * SECOND, np.int64(round(by_s * SECOND)), 0)
    if what == "stamps":
        return replace(one, time=one.time + add, log_time=one.time + LATENCY)
    return replace(one, log_time=one.time + LATENCY + add)


@pytest.mark.parametrize(
    ("topic", "by"),
    [("/gyro", 2.5), ("/position", 2.5), ("/gyro", -2.5), ("/position", -0.6), ("/gyro", 7.0),
     ("/position", 600.0), ("/gyro", -3600.0), ("/gyro", 2**32 * 1e-6),
     ("/position", 2**32 * 1e-6)],
)  # fmt: skip
def test_a_sensor_whose_clock_is_set_meanwhile_is_held_against_the_recorder(
    voyage, clean, topic, by
):
    parts = moved(0.0, ())
    parts[topic] = after(sailing.series()[topic], 20.0, by, "stamps")
    done = voyage(parts)
    assert done.table.height >= clean.table.height - 1
    both = done.table.join(clean.table, on="time", suffix="_clean")
    for name in ("x0", "heading", "surge"):
        assert float((both[name] - both[f"{name}_clean"]).abs().max()) < 1e-6
    (finding,) = [f for f in done.report.findings if "recorder's time next to it" in f.sentence]
    assert finding.kind == ("wrapped" if by > 4000 else "clock_offset")
    assert (finding.channel, topic in finding.sentence) == (topic, True)


def test_a_recorder_whose_clock_is_set_on_meanwhile_is_put_right_by_the_stamps(tmp_path):
    parts = {t: after(one, 20.0, 2.5, "log times") for t, one in sailing.series().items()}
    by_recorder = sailing.PROFILE.replace(
        'topic = "/gyro"', 'topic = "/gyro"\nclock = "log"'
    )  # of heading and yaw rate
    path = sailing.write(tmp_path / "set.mcap", parts)
    done = ingest(path, sailing.profile(by_recorder))
    (finding,) = [f for f in done.report.findings if "which have no stamp" in f.sentence]
    assert finding.value == pytest.approx(2.5, abs=0.01)
    t = (done.table["time"].to_physical().to_numpy() - sailing.START) * 1e-9
    true = 3.0 + 0.04 * (t - LATENCY / SECOND)  # rad: logged as late as it was before
    off = np.angle(np.exp(1j * (done.table["heading"].to_numpy() - true)))
    assert np.nanmax(np.abs(off)) < 1e-6
    assert (~usable(done.table)).sum() < 5  # where the clock was set


def test_a_delay_that_steps_moves_no_stamp(voyage, clean):
    parts = moved(0.0, ())
    one = sailing.series()["/gyro"]
    late = np.where(one.time - sailing.START > 20 * SECOND, 900_000_000, LATENCY)
    parts["/gyro"] = replace(one, log_time=one.time + late)
    assert voyage(parts).table.equals(clean.table)


def twice(one, back_s):
    """A topic whose recorder began again: the same times once more, behind the others."""
    shift = np.int64(round(back_s * SECOND))
    time = np.concatenate((one.time, one.time + one.time[-1] - one.time[0] - shift))
    columns = {name: np.concatenate((v, v)) for name, v in one.columns.items()}
    return Series(one.topic, one.schema, time, columns)


@pytest.mark.parametrize("back", [10.0, 59.0])
def test_a_log_whose_recorder_was_started_again_is_refused_by_name(tmp_path, back):
    parts = {topic: twice(one, back) for topic, one in sailing.series().items()}
    path = unsorted_log(tmp_path / "twice.mcap", parts)
    with pytest.raises(LogUnreadable, match=r"go back by [0-9.]+ s while the messages") as error:
        ingest(path, sailing.profile())
    assert "cut the log" in (error.value.hint or "")


def test_messages_that_were_written_late_are_sorted(tmp_path):
    parts = sailing.series()
    one = parts["/gyro"]
    order = np.r_[0:200, 300:500, 200:300, 500 : len(one.time)]
    late = {name: v[order] for name, v in one.columns.items()}
    parts["/gyro"] = Series("/gyro", one.schema, one.time[order], late)
    done = ingest(unsorted_log(tmp_path / "late.mcap", parts), sailing.profile())
    assert usable(done.table).all()
    assert {f.kind for f in done.report.findings} == {"out_of_order"}


def unsorted_log(path, parts):
    """An MCAP log of JSON, its messages in the order in which they are given."""
    import json

    from mcap.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        for topic, one in parts.items():
            schema = writer.register_schema(topic[1:], "jsonschema", b"{}")
            channel = writer.register_channel(topic, "json", schema)
            for i, time in enumerate(one.time.tolist()):
                stamp = {"sec": time // SECOND, "nsec": time % SECOND}
                values = {name: float(v[i]) for name, v in one.columns.items()}
                data = json.dumps({"timestamp": stamp, **values}).encode()
                writer.add_message(channel, time, data, time)
        writer.finish()
    return path


@pytest.mark.parametrize("most", [0.9, 3.0])
def test_a_delay_that_comes_and_goes_moves_no_stamp(voyage, clean, most):
    """A computer that hangs for seconds, and catches up, as on milliAmpere."""
    parts = moved(0.0, ())
    one = sailing.series()["/position"]
    t = (one.time - sailing.START) * 1e-9
    rng = np.random.default_rng(0)
    hump = most * np.exp(-(((t - 20.0) / 1.5) ** 2)) * rng.uniform(0.8, 1.0, len(t))
    logged = np.maximum.accumulate(one.time + LATENCY + np.rint(hump * SECOND).astype(np.int64))
    parts["/position"] = replace(one, log_time=logged)
    done = voyage(parts)
    assert done.table.equals(clean.table)
    assert not [f for f in done.report.findings if "held against" in f.sentence]


@pytest.mark.parametrize("seconds", [18.0, 37.0, -120.0])
def test_one_difference_of_clocks_is_one_finding(voyage, seconds):
    """The reader of the log sees it, too, and cannot say what ingest made of it."""
    done = voyage(moved(seconds, GNSS))
    assert len([f for f in done.report.findings if f.unit == "s" and f.value]) == 1
