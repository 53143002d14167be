"""Bags of ROS 1 and 2 that are split, compressed, still open, or hold one topic nobody can read."""

from __future__ import annotations

import sqlite3
import struct
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import zstandard
from mcap.writer import Writer

from shiplog.commands.convert import convert, draft
from shiplog.commands.prepare import check_logs, ingest_logs
from shiplog.logs.reading.read import read
from shiplog.voyages.store.store import Store

START = 1_700_000_000_000_000_000
STEP = 100_000_000
FLOAT, VECTOR = "std_msgs/msg/Float64", "geometry_msgs/msg/Vector3"
TOPICS = {
    "/rudder": (FLOAT, "float64 data", lambda i: (5.0 * (i % 3),)),
    "/fix": (VECTOR, "float64 x\nfloat64 y\nfloat64 z", lambda i: (54.0 + i * 1e-6, 10.0, 0.0)),
    "/velocity": (VECTOR, "float64 x\nfloat64 y\nfloat64 z", lambda i: (0.0, 1.1, 0.0)),
    "/heading": (FLOAT, "float64 data", lambda i: (0.02 * (i % 50),)),
}
PROFILE = """
[ship]
name = "bag"
length_m = 10.0
[sensors]
position = { kind = "geodetic", topic = "/fix", fields = ["x", "y"], unit = "deg" }
velocity = { kind = "enu", topic = "/velocity", fields = ["x", "y"], unit = "m/s" }
heading = { topic = "/heading", field = "data", unit = "deg" }
[[actuators]]
name = "rudder"
kind = "rudder"
topic = "/rudder"
field = "data"
unit = "deg"
"""


def cdr(values) -> bytes:
    return b"\0\1\0\0" + struct.pack(f"<{len(values)}d", *values)


def mcap(path: Path, first=0, count=300, skip=()) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        for topic, (kind, text, numbers) in TOPICS.items():
            if topic in skip:
                continue
            schema = writer.register_schema(kind, "ros2msg", text.encode())
            channel = writer.register_channel(topic, "cdr", schema)
            for i in range(first, first + count):
                writer.add_message(channel, START + i * STEP, cdr(numbers(i)), START + i * STEP - 5)
        writer.finish()
    return path


def metadata(folder: Path, names) -> None:
    lines = "".join(f"    - {name}\n" for name in names)
    (folder / "metadata.yaml").write_text(
        f"rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n{lines}"
    )


def split(folder: Path, packed=False) -> Path:
    """Three parts in one folder; the rudder's order is in the first alone, as it hardly changes."""
    folder.mkdir()
    names = []
    for k in range(3):
        part = mcap(folder / f"bag_{k}.mcap", 300 * k, skip=("/rudder",) if k else ())
        if packed:
            whole = part.with_name(part.name + ".zstd")
            whole.write_bytes(zstandard.ZstdCompressor().compress(part.read_bytes()))
            part.unlink()
            part = whole
        names.append(part.name)
    metadata(folder, names)
    return folder


def database(path: Path, topics=TOPICS, count=300, kinds=None, wal=None) -> Path:
    """As rosbag2 writes them since Iron; `kinds` changes a type's (encoding, definition), and of
    the messages the last `wal` are committed but not in the database."""
    base = sqlite3.connect(path)
    base.executescript(
        "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
        "INSERT INTO schema VALUES (4, 'jazzy');"
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format "
        "TEXT, offered_qos_profiles TEXT, type_description_hash TEXT);"
        "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT, "
        "encoded_message_definition TEXT, type_description_hash TEXT);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data "
        "BLOB);"
    )
    every = []
    for number, (topic, (kind, text, numbers)) in enumerate(topics.items(), 1):
        encoding, text = (kinds or {}).get(kind, ("ros2msg", text))
        base.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '', '')", (number, topic, kind))
        base.execute(
            "INSERT INTO message_definitions(topic_type, encoding, encoded_message_definition, "
            "type_description_hash) VALUES (?, ?, ?, '')", (kind, encoding, text),
        )  # fmt: skip
        every += [(number, START + i * STEP, cdr(numbers(i))) for i in range(count)]
    every.sort(key=lambda row: row[1])
    base.commit()
    sentence = "INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)"
    settled = len(every) - (wal or 0)
    base.executemany(sentence, every[:settled])
    base.commit()
    if wal:
        base.execute("PRAGMA journal_mode = WAL")
        base.execute("PRAGMA wal_autocheckpoint = 0")
        base.executemany(sentence, every[settled:])
        base.commit()
        keep = {p.name: p.read_bytes() for p in path.parent.glob(f"{path.name}*")}
        base.close()
        for name, content in keep.items():  # as a recorder leaves them that was killed
            (path.parent / name).write_bytes(content)
        (path.parent / f"{path.name}-shm").unlink()
        return path
    base.close()
    return path


def logged(source: Path, out: Path):
    done = convert([source], None, out)
    assert not done.refused, done.refused
    (log,) = done.logs
    return read(log).frames, "; ".join(done.lost.values())


def times(count: int) -> list[int]:
    return [START + i * STEP for i in range(count)]


@pytest.mark.parametrize("packed", [False, True])
def test_the_parts_of_a_folder_of_mcap_are_one_log(tmp_path, packed):
    frames, lost = logged(split(tmp_path / "trip", packed), tmp_path / "out")
    assert not lost and set(frames) == set(TOPICS)
    assert frames["/heading"]["log_time"].to_list() == times(900)
    assert frames["/heading"]["publish_time"].to_list() == [t - 5 for t in times(900)]
    assert frames["/rudder"].height == 300
    assert (tmp_path / "out" / "trip.mcap").is_file()


def test_parts_and_folder_given_together_are_one_log(tmp_path):
    source = split(tmp_path / "trip")
    done = convert([*sorted(source.glob("*.mcap")), source], None, tmp_path / "out")
    assert [log.name for log in done.logs] == ["trip.mcap"] and not done.refused


def test_what_the_metadata_lists_and_is_not_there_is_said(tmp_path):
    source = split(tmp_path / "trip")
    (source / "bag_1.mcap").unlink()
    frames, lost = logged(source, tmp_path / "out")
    assert "bag_1.mcap" in lost and frames["/heading"].height == 600


@pytest.mark.parametrize("text", ["", "a: [", "rosbag2_bagfile_information: {version: 5}"])
def test_without_a_list_every_part_is_read(tmp_path, text):
    source = split(tmp_path / "trip")
    (source / "metadata.yaml").write_text(text)
    frames, _ = logged(source, tmp_path / "out")
    assert frames["/heading"].height == 900


def test_a_damaged_part_costs_no_other(tmp_path):
    source = split(tmp_path / "trip")
    (source / "bag_1.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(100))
    frames, lost = logged(source, tmp_path / "out")
    assert "bag_1.mcap" in lost and frames["/heading"].height == 600


@pytest.mark.parametrize("wal", [1, 400, 1199])
def test_rows_that_a_database_has_not_taken_in_are_read(tmp_path, wal):
    source = database(tmp_path / "bag.db3", wal=wal)
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    frames, lost = logged(source, tmp_path / "out")
    assert not lost and {frame.height for frame in frames.values()} == {300}
    after = {p.name: p.read_bytes() for p in tmp_path.iterdir() if p.is_file()}
    assert after == before  # the user's files are as they were


def test_rows_that_were_never_committed_are_none(tmp_path):
    source = database(tmp_path / "bag.db3", wal=400)
    wal = source.with_name("bag.db3-wal")
    wal.write_bytes(wal.read_bytes()[:-200])  # the commit is in the last frame
    frames, _ = logged(source, tmp_path / "out")
    assert sum(frame.height for frame in frames.values()) == 800


@pytest.mark.parametrize(
    ("encoding", "text", "why"),
    [
        ("unknown", "", "nothing says what a usv/msg/Own holds"),
        ("ros2msg", "wstring name\nfloat64 x", "wstring"),
        ("ros2msg", "usv/Lost part", "usv/Lost"),
        ("ros2idl", "module usv { union", "IDL"),
    ],
)
def test_one_topic_that_cannot_be_read_costs_itself_alone(tmp_path, encoding, text, why):
    topics = {**TOPICS, "/own": ("usv/msg/Own", text, lambda i: (1.0 * i,))}
    kinds = {"usv/msg/Own": (encoding, text)}
    frames, lost = logged(database(tmp_path / "bag.db3", topics, kinds=kinds), tmp_path / "out")
    assert set(frames) == set(TOPICS) and frames["/fix"].height == 300
    assert lost.startswith("/own: ") and why in lost


def test_a_type_of_ros_needs_no_definition(tmp_path):
    kinds = {FLOAT: ("unknown", ""), VECTOR: ("", "")}
    frames, lost = logged(database(tmp_path / "bag.db3", kinds=kinds), tmp_path / "out")
    assert not lost and frames["/fix"]["x"][10] == pytest.approx(54.00001)


@pytest.mark.parametrize("ending", ["zstd", "zst", "gz"])
def test_a_log_that_is_packed_as_a_whole_is_read(tmp_path, ending):
    import gzip

    plain = mcap(tmp_path / "plain.mcap")
    path = tmp_path / f"trip.mcap.{ending}"
    pack = gzip.compress if ending == "gz" else zstandard.ZstdCompressor().compress
    path.write_bytes(pack(plain.read_bytes()))
    frames, _ = logged(path, tmp_path / "out")
    assert frames["/heading"].height == 300
    assert "/heading" in draft(path)
    (report,) = check_logs([path]).reports
    assert (report.name, report.messages_read) == ("trip", 1200)


def test_check_draft_and_ingest_take_a_split_bag(tmp_path):
    source = split(tmp_path / "trip")
    (tmp_path / "p.toml").write_text(PROFILE)
    (report,) = check_logs([source], str(tmp_path / "p.toml")).reports
    assert (report.name, report.messages_read) == ("trip", 3000)
    assert "/heading" in draft(source)
    store = Store(tmp_path / "store")
    for _ in range(2):  # the same content again changes nothing
        done = ingest_logs([source], str(tmp_path / "p.toml"), store)
        assert [r.name for r in done.reports] == ["trip"] and not done.refused
    frame = pl.read_parquet(tmp_path / "store" / "voyage=trip" / "table.parquet")
    assert frame.height == 900 and len(list(store.entries())) == 1


def ros1(path: Path, topics) -> Path:
    """A bag of messages of own types: topic → (name, definition, bytes of each message)."""
    from rosbags.rosbag1 import Writer as Bag

    with Bag(path) as bag:
        for topic, (name, text, messages) in topics.items():
            line = bag.add_connection(topic, name, msgdef=text, md5sum="0" * 32)
            for i, data in enumerate(messages):
                bag.write(line, START + i * STEP, data)
    return path


def test_ros1_names_with_capitals_are_read(tmp_path):
    data = [struct.pack("<dfB", 59.0 + i, 0.5, i) for i in range(20)]
    source = ros1(tmp_path / "usv.bag", {
        "/gps": ("usv/msg/GPS", "float64 Lat\nfloat32 HDOP\nuint8 DevID\n", data),
        "/odd": ("usv/msg/Odd", "float64 __a\nfloat32 class\nuint8 CamelCase_\n", data),
    })  # fmt: skip
    frames, lost = logged(source, tmp_path / "out")
    assert not lost
    assert frames["/gps"]["Lat"].to_list() == [59.0 + i for i in range(20)]
    assert frames["/gps"]["HDOP"].to_list() == [0.5] * 20
    assert frames["/odd"]["class"].to_list() == [0.5] * 20
    assert frames["/odd"]["CamelCase_"].to_list() == list(range(20))


@pytest.mark.parametrize(
    ("text", "pack", "fields"),
    [("float32 RPM\nbool EN\n", "<fB", {"RPM": 120.0, "EN": 1.0}),
     ("geometry/XY Pos\n" + "=" * 80 + "\nMSG: geometry/XY\nfloat64 X\nfloat64 Y\n", "<dd",
      {"Pos.X": 3.0, "Pos.Y": -4.0}),
     ("int16[2] RudderAngle\nfloat64 COG\n", "<hhd", {"COG": 271.5})],
    ids=["short", "nested", "beside a list"],
)  # fmt: skip
def test_ros1_capitals_of_own_types(tmp_path, text, pack, fields):
    values = {"<fB": (120.0, 1), "<dd": (3.0, -4.0), "<hhd": (5, -5, 271.5)}[pack]
    data = [struct.pack(pack, *values)] * 5
    frames, lost = logged(ros1(tmp_path / "own.bag", {"/own": ("usv/msg/Own", text, data)}),
                          tmp_path / "out")  # fmt: skip
    assert not lost
    assert {name: frames["/own"][name].to_list() for name in fields} == {
        name: [value] * 5 for name, value in fields.items()
    }


def test_ros1_letters_beyond_ascii_cost_nothing(tmp_path):
    texts = [b"M\xfcritz", b"plain", b"\xff\xfe"]
    data = [struct.pack("<I", len(t)) + t + struct.pack("<d", i) for i, t in enumerate(texts)]
    source = ros1(tmp_path / "usv.bag", {"/x": ("usv/msg/X", "string s\nfloat64 x\n", data)})
    frames, lost = logged(source, tmp_path / "out")
    assert not lost and frames["/x"]["x"].to_list() == [0.0, 1.0, 2.0]
    assert frames["/x"]["s"].to_list()[:2] == ["Müritz", "plain"]


def test_two_ros1_definitions_of_one_name_are_both_read(tmp_path):
    """Recorded before and after a change of the message."""
    source = ros1(tmp_path / "usv.bag", {
        "/old": ("usv/msg/X", "float64 x\n", [struct.pack("<d", i) for i in range(5)]),
        "/new": ("usv/msg/X", "float32 y\nfloat64 x\n",
                 [struct.pack("<fd", 1, i) for i in range(5)]),
    })  # fmt: skip
    frames, lost = logged(source, tmp_path / "out")
    assert not lost
    for topic in ("/old", "/new"):
        assert frames[topic]["x"].to_list() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_one_ros1_type_that_is_broken_costs_itself_alone(tmp_path):
    source = ros1(tmp_path / "usv.bag", {
        "/x": ("usv/msg/X", "float64 x\n", [struct.pack("<d", i) for i in range(5)]),
        "/bad": ("usv/msg/Bad", "float64\n", [b"12345678"] * 5),
        "/lost": ("usv/msg/Lost", "usv/Nowhere n\n", [b"12345678"] * 5),
    })  # fmt: skip
    done = convert([source], None, tmp_path / "out")
    frames = read(done.logs[0]).frames
    assert frames["/x"]["x"].to_list() == list(np.arange(5.0))
    said = "".join(done.lost.values())
    assert "/bad: " in said and "/lost: " in said


def test_a_part_given_alone_is_told_what_it_is(tmp_path):
    """Three parts without their metadata.yaml: the second has no rudder, and the hint says why."""
    parts = [
        mcap(tmp_path / f"bag_{k}.mcap", 300 * k, skip=("/rudder",) if k else ()) for k in range(3)
    ]
    (tmp_path / "p.toml").write_text(PROFILE)
    done = ingest_logs(parts, str(tmp_path / "p.toml"), Store(tmp_path / "store"))
    assert [report.name for report in done.reports] == ["bag_0"]
    for error in done.refused.values():
        assert "split recording" in error.hint and "metadata.yaml" in error.hint
