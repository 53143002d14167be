"""Two antennas on one topic, by their frames or their channels: values of one, and it is said."""

from __future__ import annotations

import json

import numpy as np
import polars as pl
import pytest
import sailing
from mcap.writer import Writer

from shiplog.commands.prepare import check_logs
from shiplog.exceptions import ChannelMissing
from shiplog.logs.reading.senders import senders
from shiplog.voyages.ingest.ingest import ingest

COUNT, STEP = 400, 100_000_000
APART = 12.0  # m between the two antennas, along y0
SPEED = 2.0
TEXT = """
[ship]
name = "two"
length_m = 30.0
[sensors.position]
kind = "local"
topic = "/fix"
fields = ["x", "y"]
unit = "m"
{more}
[sensors.velocity]
kind = "ned"
topic = "/velocity"
fields = ["north", "east"]
unit = "m/s"
[sensors.heading]
topic = "/heading"
field = "heading"
unit = "rad"
"""


@pytest.fixture
def log(tmp_path):
    """A ship that goes north; each fix of /fix is of one antenna: `who` says whose, message by
    message, and `frames` and `channels` how it shows."""

    def write(who, frames=("gps_port", "gps_stbd"), metadata=({},), nest=False, chunk=4096):
        path = tmp_path / "two.mcap"
        with path.open("wb") as stream:
            writer = Writer(stream, chunk_size=chunk)
            writer.start()
            schema = writer.register_schema("t.Any", "jsonschema", b"{}")
            fixes = [writer.register_channel("/fix", "json", schema, one) for one in metadata]
            others = [writer.register_channel(t, "json", schema) for t in ("/velocity", "/heading")]
            for i in range(COUNT):
                time = sailing.START + i * STEP
                stamp = {"sec": time // 10**9, "nanosec": time % 10**9}
                antenna = who(i)
                frame = frames[antenna]
                header = {"stamp": stamp} if frame is None else {"stamp": stamp, "frame_id": frame}
                x = SPEED * i * 0.1
                fix = {"x": x, "y": APART * antenna}
                fix |= {"header": header} if nest or frame is not None else {"timestamp": stamp}
                fixes_of = fixes[antenna % len(fixes)]
                writer.add_message(fixes_of, time, json.dumps(fix).encode(), time)
                for channel, values in zip(
                    others, ({"north": SPEED, "east": 0.0}, {"heading": 0.0}), strict=True
                ):
                    text = json.dumps({"timestamp": stamp, **values}).encode()
                    writer.add_message(channel, time, text, time)
            writer.finish()
        return path

    return write


def voyage(path, more=""):
    return ingest(path, sailing.profile(TEXT.replace("{more}", more)))


def usable(done) -> pl.DataFrame:
    return done.table.filter(pl.col("x0").is_not_null())


def alternating(i):
    return i % 2


SHOWN = {
    "frames": {},
    "channels of two nodes": {"frames": (None, None),
                              "metadata": ({"callerid": "/a"}, {"callerid": "/b"})},
    "channels without a name": {"frames": (None, None), "metadata": ({}, {"x": "1"})},
}  # fmt: skip


@pytest.mark.parametrize("how", SHOWN)
def test_only_one_of_two_that_take_turns_is_used_and_both_are_named(log, how):
    done = voyage(log(alternating, **SHOWN[how]))
    assert set(usable(done)["y0"].unique()) <= {0.0}  # never in between, nor the other one
    (finding,) = [f for f in done.report.findings if f.kind == "two_sources"]
    names = {"frames": ("gps_port", "gps_stbd"), "channels of two nodes": ("/a", "/b"),
             "channels without a name": ("channel 1", "channel 2")}[how]  # fmt: skip
    assert all(repr(name) in finding.sentence for name in names)
    assert (
        "/fix" in finding.sentence and "5 Hz" in finding.sentence and "frame =" in finding.sentence
    )
    assert finding.value == 2.0 and done.report.serious


@pytest.mark.parametrize("how", SHOWN)
def test_the_profile_chooses(log, how):
    name = {"frames": "gps_stbd", "channels of two nodes": "/b",
            "channels without a name": "channel 2"}[how]  # fmt: skip
    done = voyage(log(alternating, **SHOWN[how]), f'frame = "{name}"\nlever_arm_m = [0.0, 12.0]')
    table = usable(done)
    assert table.height > 190 and table["y0"].to_numpy() == pytest.approx(0.0, abs=1e-9)
    assert not [f for f in done.report.findings if f.kind == "two_sources"]
    assert not done.report.serious


def test_the_more_frequent_one_is_taken(log):
    done = voyage(log(lambda i: int(i % 4 != 0)))
    assert set(usable(done)["y0"].unique()) == {APART}


@pytest.mark.parametrize(
    "who", [lambda i: 0, lambda i: int(i > 200), lambda i: int(i in (7, 90, 333))],
    ids=["one", "renamed once", "a few strays"],
)  # fmt: skip
def test_what_does_not_take_turns_is_one(log, who):
    done = voyage(log(who))
    assert not [f for f in done.report.findings if f.kind == "two_sources"]
    assert not done.report.serious


def test_a_recorder_that_was_started_again_is_one(log):
    shown = {"frames": (None, None), "metadata": ({"callerid": "/a"}, {"callerid": "/b"})}
    done = voyage(log(lambda i: int(i >= 150), **shown))
    assert not [f for f in done.report.findings if f.kind == "two_sources"]
    assert usable(done).height > 390


def test_one_channel_of_one_frame_stays_as_it_is(log):
    assert not senders(log(lambda i: 0), {"/fix": ["header.frame_id"]})["/fix"].several


def test_a_frame_that_nobody_has_is_refused_with_those_there_are(log):
    with pytest.raises(ChannelMissing, match="'gps_port', 'gps_stbd'"):
        voyage(log(alternating), 'frame = "gps_bow"')


def test_check_says_it_as_well(log, tmp_path):
    (tmp_path / "p.toml").write_text(TEXT.replace("{more}", ""))
    (report,) = check_logs([log(alternating)], str(tmp_path / "p.toml")).reports
    assert [f.channel for f in report.findings if f.kind == "two_sources"] == ["/fix"]


def test_two_that_begin_late_in_a_long_log_are_found(log):
    """The second antenna is switched on in the second half: the first chunks show one."""
    done = voyage(log(lambda i: i % 2 if i >= 200 else 0))
    assert [f.kind for f in done.report.findings if f.kind == "two_sources"]
    assert np.isclose(usable(done)["y0"].to_numpy(), 0.0).all()
