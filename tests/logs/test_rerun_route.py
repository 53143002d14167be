"""Rerun's reader gives the tables of the packages, and no log is lost by it."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from made_logs import COUNT, SECOND, START, assert_same, by_the_package, chunks, known_colours
from mcap.writer import IndexType
from mcap_ros2.writer import Writer as Ros2Writer
from polars.testing import assert_frame_equal

from shiplog.logs.reading import rerun_route
from shiplog.logs.reading.read import read


@pytest.mark.parametrize(
    "wanted",
    [None, {"/b": ("value", "small", "points[0].z", "covariance[1]", "names", "point.x", "raw")}],
    ids=["everything", "some"],
)
@pytest.mark.parametrize("jitter", [0, 10], ids=["in order", "out of order"])
def test_rerun_and_the_packages_give_one_protobuf_table(tmp_path, by_rerun, wanted, jitter):
    path = known_colours(
        tmp_path / "log.mcap",
        times=lambda k: START + k // 3 * SECOND + (9 * SECOND if jitter and k % jitter == 0 else 0),
    )
    found = assert_same(path, wanted)
    assert set(by_rerun) == set(found.frames)
    assert found.health.route == "fast"


def test_topics_with_odd_or_shared_names_do_not_get_mixed_up(tmp_path, by_rerun):
    topics = ("/a b.c-d", "x", "/x", "/é(ü)/z")
    path = known_colours(tmp_path / "log.mcap", count=80, topics=topics)
    assert assert_same(path).frames.keys() == set(topics)
    assert set(by_rerun) == {"/a b.c-d", "/é(ü)/z"}  # Rerun calls both x and /x the same


@pytest.mark.parametrize(
    "payload", [b"\xff", b"\x42\x02\xff\xfe", b"\x42\x20a"], ids=["tag", "UTF-8", "cut"]
)
def test_one_bad_payload_costs_one_message_on_either_route(tmp_path, by_rerun, payload):
    path = known_colours(tmp_path / "log.mcap", count=90, replaced={31: payload})
    found = assert_same(path)
    assert set(by_rerun) == {"/a", "/c"}
    assert {t: frame.height for t, frame in found.frames.items()} == {"/a": 30, "/b": 29, "/c": 30}
    (finding,) = found.health.findings
    assert (finding.kind, finding.channel, finding.value) == ("crc", "/b", 1.0)


def test_a_payload_that_ends_reruns_process_is_read_all_the_same(good, by_rerun):
    """An enum number newer than the schema; the next log finds Rerun running again."""
    found = assert_same(good)
    assert by_rerun == []
    assert sum(frame.height for frame in found.frames.values()) == COUNT
    assert_frame_equal(found.frames["/a"], by_the_package(good, "/a"))


def test_rerun_is_not_waited_for_longer_than_it_may_take(tmp_path, by_rerun, monkeypatch):
    path = known_colours(tmp_path / "log.mcap")
    with monkeypatch.context() as impatient:
        impatient.setattr(rerun_route, "START_TIMEOUT_S", 0.0)
        impatient.setattr(rerun_route, "PACE", 1e12)
        assert_same(path)
        assert by_rerun == []
    assert_same(path)
    assert set(by_rerun) == {"/a", "/b", "/c"}


@pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux")
def test_a_reader_without_memory_leaves_the_log_to_the_other(tmp_path, by_rerun, monkeypatch):
    """It may take no more than it has when it has just started."""
    path = known_colours(tmp_path / "log.mcap", count=900)
    rerun_route.worker().stop()
    monkeypatch.setattr(rerun_route.reading_limits, "memory", lambda size: 0)
    assert_same(path)
    assert by_rerun == []
    rerun_route.worker().stop()  # it may have survived, with that limit


def test_a_killed_worker_is_replaced(tmp_path, by_rerun):
    path = known_colours(tmp_path / "log.mcap", count=90)
    read(path)
    process = rerun_route.worker()._process
    assert process is not None
    process.kill()
    process.wait()
    read(path)
    assert sorted(by_rerun) == sorted(2 * ["/a", "/b", "/c"])


def test_only_a_clean_log_is_given_to_rerun(tmp_path, by_rerun):
    whole = known_colours(tmp_path / "whole.mcap")
    where, size, lost = chunks(whole)[1]
    data = bytearray(whole.read_bytes())
    data[where + size // 2] ^= 0xFF
    flipped = tmp_path / "flipped.mcap"
    flipped.write_bytes(data)
    assert read(flipped).health.messages_lost == lost
    loose = known_colours(tmp_path / "loose.mcap", use_chunking=False)
    assert read(loose).health.messages_read == COUNT
    bare = known_colours(tmp_path / "bare.mcap", index_types=IndexType.CHUNK)
    assert read(bare).health.messages_read == COUNT
    assert by_rerun == []


SCRIPT = """
import sys
from shiplog.logs.reading import rerun_route
from shiplog.logs.reading.read import read
rerun_route.LEAST_MESSAGES = 0
assert "numba" not in sys.modules and "rerun" not in sys.modules
print(read(sys.argv[1]).health.messages_read, rerun_route.worker()._process.pid)
"""


def test_no_process_is_left_behind(tmp_path):
    """From a script without a main guard, and from a child that multiprocessing spawned."""
    path = known_colours(tmp_path / "log.mcap", count=90)
    command = [sys.executable, "-W", "error", "-c", SCRIPT, str(path)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60)
    count, worker = map(int, done.stdout.split())
    assert (count, done.stderr) == (90, "")
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        spawned = pool.apply(_in_a_child, (path,))
        pool.close()
        pool.join()
    for left in (worker, spawned):
        until = time.monotonic() + 10.0
        while _runs(left) and time.monotonic() < until:
            time.sleep(0.05)
        assert not _runs(left)


def _in_a_child(path: Path) -> int:
    rerun_route.LEAST_MESSAGES = 0
    assert read(path).health.messages_read == 90
    process = rerun_route.worker()._process
    assert process is not None
    return process.pid


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    with contextlib.suppress(OSError):  # one that ended but that nobody here may collect
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return True


ROS = """std_msgs/Header header
bool on
char small
float64 value
string<=9 label
int16[3] three
float64[] many
string[] names
Empty nothing
Point[] points
float32 last
uint8 CONSTANT=3
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: t/Empty
================================================================================
MSG: t/Point
float64 x # ahead
string name "none"
float64 y
"""
CLOCK = """================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


@pytest.mark.parametrize(
    ("definition", "given"),
    [(ROS.replace("Empty nothing\n", "") + CLOCK, ["/kind"]), (ROS + CLOCK, []), (ROS, [])],
    ids=["plain", "with an empty message", "without Time"],
)
def test_rerun_and_the_ros_package_give_one_table(tmp_path, by_rerun, definition, given):
    path = tmp_path / "ros.mcap"
    with path.open("wb") as stream:
        writer = Ros2Writer(stream)
        schema = writer.register_msgdef("t/msg/Kind", definition)
        for k in range(50):
            points = [{"x": i / 2, "name": "p" * i, "y": -i} for i in range(k % 4)]
            message = {
                "header": {"stamp": {"sec": 1_700_000_000 + k, "nanosec": 5}, "frame_id": "f" * k},
                "on": k % 2 == 0, "small": k, "value": k / 3, "label": "x" * (k % 5),
                "three": [k, -k, 7], "many": [0.5] * (k % 3), "names": ["a"] * (k % 2),
                "nothing": {}, "points": points, "last": k / 8,
            }  # fmt: skip
            writer.write_message("/kind", schema, message, START + k, START + k)
        writer.finish()
    found = assert_same(path).frames["/kind"]
    assert by_rerun == given
    assert found["stamp"].to_list() == [START + k * SECOND + 5 for k in range(50)]
    assert found["last"].to_list() == [k / 8 for k in range(50)]
    assert found["three"].to_list() == [[k, -k, 7] for k in range(50)]
    assert found["points"].to_list()[3][2] == {"x": 1.0, "name": "pp", "y": -2.0}
