"""ROS messages: read as rosbags writes them, as bytes by hand, cut, compressed, and of ROS 1."""

from __future__ import annotations

import struct

import numpy as np
import polars as pl
import pytest
import zstandard
from mcap.writer import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from shiplog.exceptions import LogUnreadable
from shiplog.logs.reading.check import check
from shiplog.logs.reading.read import fields, read

START = 1_700_000_000_000_000_000
RULE = "\n" + "=" * 80 + "\n"
KIND = (
    "std_msgs/Header header\nfloat64 SOG\nbool on\nint16 MsgID\nfloat32[3] three\nfloat64[] many\n"
    "string label\nuint8[] raw\nt/Point[] points\nt/Point one\nfloat64 last\nint8 RED=1\n"
)
POINT = "float64 X\nstring name # a comment\nint8 y"


@pytest.fixture
def log(tmp_path):
    def write(payloads, text="float64 data", name="t/msg/Kind", kinds=("cdr", "ros2msg"), more=()):
        path = tmp_path / "log.mcap"
        with path.open("wb") as stream:
            writer = Writer(stream)
            writer.start()
            for topic, (of, encoding, definition, messages) in {
                "/x": (name, kinds, text, payloads), **dict(more),
            }.items():  # fmt: skip
                schema = writer.register_schema(of, encoding[1], definition.encode())
                channel = writer.register_channel(topic, encoding[0], schema)
                for k, payload in enumerate(messages):
                    writer.add_message(channel, START + k * 10**8, payload, START + k * 10**8)
            writer.finish()
        return path

    return write


def numbers(*values, head=b"\0\1\0\0", order="<") -> bytes:
    return head + struct.pack(f"{order}{len(values)}d", *values)


def store_of(ros: str):
    store = get_typestore(Stores[ros])
    store.register(get_types_from_msg(POINT, "t/msg/Point"))
    store.register(get_types_from_msg(KIND, "t/msg/Kind"))
    return store


def messages(store, ros1: bool):
    """Eleven messages with lists of every length from 0 on, so that each alignment is met."""
    kinds = store.types
    header, time = kinds["std_msgs/msg/Header"], kinds["builtin_interfaces/msg/Time"]
    point, kind = kinds["t/msg/Point"], kinds["t/msg/Kind"]
    for k in range(11):
        stamp = time(1_700_000_000 + k, 5)
        head = header(seq=k, stamp=stamp, frame_id="f" * k) if ros1 else header(stamp, "f" * k)
        points = [point(i / 2, "p" * i, -i) for i in range(k % 4)]
        yield kind(
            head, k / 3, k % 2 == 0, -k, np.array([k, 0.5, -1], np.float32), np.full(k % 3, 0.25),
            "x" * (k % 5), np.arange(k % 4, dtype=np.uint8), points, point(7.0, "o", 1), k / 8,
        )  # fmt: skip


def definition(store, ros: int) -> str:
    return store.generate_msgdef("t/msg/Kind", ros_version=ros)[0]


@pytest.mark.parametrize("form", ["cdr", "big endian", "ros1"])
def test_every_field_is_read_as_it_was_written(log, form):
    """Among them names with capitals, which ROS 1 allows."""
    ros1 = form == "ros1"
    store = store_of("ROS1_NOETIC" if ros1 else "ROS2_HUMBLE")
    payloads = [
        bytes(store.serialize_ros1(m, "t/msg/Kind") if ros1
              else store.serialize_cdr(m, "t/msg/Kind", little_endian=form == "cdr"))
        for m in messages(store, ros1)
    ]  # fmt: skip
    kinds = ("ros1", "ros1msg") if ros1 else ("cdr", "ros2msg")
    name = "t/Kind" if ros1 else "t/msg/Kind"
    path = log(payloads, definition(store, 1 if ros1 else 2), name, kinds)
    found = read(path).frames["/x"]
    k = range(11)
    assert found["SOG"].to_list() == [i / 3 for i in k]
    assert found["MsgID"].to_list() == [-i for i in k]
    assert found["on"].to_list() == [i % 2 == 0 for i in k]
    assert found["three"].to_list() == [[i, 0.5, -1.0] for i in k]
    assert found["many"].to_list() == [[0.25] * (i % 3) for i in k]
    assert found["label"].to_list() == ["x" * (i % 5) for i in k]
    assert found["header.frame_id"].to_list() == ["f" * i for i in k]
    assert found["stamp"].to_list() == [START + i * 10**9 + 5 for i in k]
    assert found["points"].to_list()[3] == [
        {"X": i / 2, "name": "p" * i, "y": -i} for i in range(3)
    ]
    assert found["one.X"].to_list() == [7.0] * 11 and found["last"].to_list() == [i / 8 for i in k]
    assert "raw" not in found.columns
    asked = read(path, {"/x": ["last", "raw", "points[1].X"]}).frames["/x"]
    assert asked["last"].to_list() == [i / 8 for i in k]
    assert asked["raw"].to_list() == [list(range(i % 4)) for i in k]
    assert asked["points[1].X"].to_list() == [0.5 if i % 4 > 1 else None for i in k]
    assert fields(path)["/x"]["MsgID"] == pl.Int16


def test_xcdr2_aligns_to_four_bytes_at_most(log):
    """OMG DDS-XTYPES 1.3, 7.4.3.4.1: PLAIN_CDR2; a double may follow an int32 at once."""
    payloads = [
        b"\0\7\0\0" + struct.pack("<id", k, k / 4) for k in range(5)
    ] + [b"\0\6\0\0" + struct.pack(">id", 9, 0.125)]  # fmt: skip
    found = read(log(payloads, "int32 n\nfloat64 x")).frames["/x"]
    assert found["x"].to_list() == [0.0, 0.25, 0.5, 0.75, 1.0, 0.125]
    assert found["n"].to_list() == [0, 1, 2, 3, 4, 9]


CUT = {
    "a number": ("float64 a\nfloat64 b", numbers(1.0, 2.0), 5),
    "all but the header": ("float64 a\nfloat64 b", numbers(1.0, 2.0), 16),
    "everything": ("float64 a\nfloat64 b", numbers(1.0, 2.0), 20),
    "a text at the end": (
        "float64 a\nstring s",
        numbers(1.0) + struct.pack("<I", 5) + b"four\0",
        3,
    ),
    "bytes at the end": ("float64 a\nuint8[] s", numbers(1.0) + struct.pack("<I", 5) + b"fives", 2),
    "a list": ("float64 a\nfloat32[] s", numbers(1.0) + struct.pack("<I3f", 3, 1, 2, 3), 4),
    "a list of fixed length": ("float64[3] a", numbers(1.0, 2.0, 3.0), 8),
}


@pytest.mark.parametrize("many", [False, True], ids=["by hand", "by Rerun"])
@pytest.mark.parametrize("what", CUT)
def test_a_cut_payload_is_a_lost_message(log, what, many, request):
    """Even where what is wanted stands before the cut: nothing says that it is whole."""
    if many:
        request.getfixturevalue("by_rerun")
    text, payload, cut = CUT[what]
    payloads = [payload] * 9 + [payload[:-cut]] + [payload] * 10
    path = log(payloads, text)
    found = read(path, {"/x": ["a", "s", "a[0]"]})
    assert found.frames["/x"].height == 19
    assert (found.health.messages_read, found.health.messages_lost) == (20, 1)
    (finding,) = found.health.findings
    assert finding.kind == "crc" and "do not fit their schema" in finding.sentence
    assert check(path).serious


@pytest.mark.parametrize("many", [False, True], ids=["by hand", "by Rerun"])
def test_compressed_payloads_are_unpacked(log, many, request):
    """rosbag2 record --compression-mode message: every payload is a frame of zstd."""
    if many:
        request.getfixturevalue("by_rerun")
    plain = [numbers(54.0 + k, -0.5 * k) for k in range(40)]
    packed = [zstandard.ZstdCompressor(level=1 + k % 9).compress(p) for k, p in enumerate(plain)]
    found = read(log(packed, "float64 x\nfloat64 y"))
    assert found.frames["/x"]["x"].to_list() == [54.0 + k for k in range(40)]
    assert found.frames["/x"]["y"].to_list() == [-0.5 * k for k in range(40)]
    assert found.health.messages_lost == 0


def test_a_compressed_payload_that_is_cut_or_too_large_is_lost(log):
    whole = zstandard.ZstdCompressor().compress(numbers(1.0))
    bomb = zstandard.ZstdCompressor().compress(bytes(64 << 20))
    unstated = zstandard.ZstdCompressor(write_content_size=False).compress(bytes(64 << 20))
    stream = zstandard.ZstdCompressor(write_content_size=False).compress(numbers(2.0))
    found = read(log([whole, whole[:-3], bomb, unstated, stream]))
    assert found.frames["/x"]["data"].to_list() == [1.0, 2.0]
    assert found.health.messages_lost == 3


IDL = f"""{"=" * 80}
IDL: t/msg/Kind
#include "t/msg/Point.idl"
module t {{ module msg {{
  enum Colour {{ RED, GREEN, BLUE }};
  struct Kind {{
    @verbatim(language="comment", text="a {{ comment")
    t::msg::Point place;
    sequence<double> many;
    @unit(value="m")
    double last;
    string label;
    float three[3];
    Colour colour;
  }};
}}; }};
{"=" * 80}
IDL: t/msg/Point
module t {{ module msg {{ struct Point {{ double X; int32 n; }}; }}; }};
"""


def test_idl_is_read(log):
    def payload(k):
        many = struct.pack(f"<I{k}d", k, *[0.5] * k)
        data = struct.pack("<di", k / 2, -k) + many
        data += bytes(-len(data) % 8) + struct.pack("<d", k / 8) + struct.pack("<I", 3) + b"ab\0"
        return b"\0\1\0\0" + data + bytes(-len(data) % 4) + struct.pack("<3fI", k, 1, 2, 2)

    found = read(log([payload(k) for k in range(4)], IDL, kinds=("cdr", "ros2idl"))).frames["/x"]
    assert found["place.X"].to_list() == [0.0, 0.5, 1.0, 1.5]
    assert found["place.n"].to_list() == [0, -1, -2, -3]
    assert found["many"].to_list() == [[0.5] * k for k in range(4)]
    assert found["last"].to_list() == [k / 8 for k in range(4)]
    assert found["label"].to_list() == ["ab"] * 4
    assert found["three"].to_list() == [[k, 1.0, 2.0] for k in range(4)]
    assert found["colour"].to_list() == [2] * 4


def test_a_definition_of_text_whose_part_is_idl(log):
    text = f"t/Point at\nfloat64 x{RULE}IDL: t/msg/Point\n"
    text += "module t { module msg { struct Point { double X; }; }; };"
    found = read(log([numbers(k, 2.0 * k) for k in range(3)], text)).frames["/x"]
    assert found["at.X"].to_list() == [0.0, 1.0, 2.0] and found["x"].to_list() == [0.0, 2.0, 4.0]


@pytest.mark.parametrize("encoding", ["", "unknown"])
def test_a_known_type_without_a_definition_is_ros_own(log, encoding):
    payloads = [numbers(k, 2.0, 3.0) for k in range(3)]
    kinds = ("cdr", encoding)
    found = read(log(payloads, "", "geometry_msgs/msg/Vector3", kinds)).frames["/x"]
    assert found["x"].to_list() == [0.0, 1.0, 2.0] and found["z"].to_list() == [3.0] * 3


@pytest.mark.parametrize(
    ("kinds", "text", "why"),
    [
        (("cdr", "unknown"), "", "nothing says what a t/msg/Kind holds"),
        (("cdr", "ros2msg"), "float64 a\nwstring s", "a wstring, which is not read"),
        (("cdr", "ros2msg"), "t/Lost a", "nothing says what the t/Lost 'a'"),
        (("cdr", "ros2msg"), "t/Kind a", "contains itself"),
        (("cdr", "ros2msg"), "float64", "'float64' is no field"),
        (("cdr", "ros2idl"), "module t { nonsense", "it is no IDL"),
    ],
)
def test_a_topic_that_cannot_be_read_costs_itself_alone(log, kinds, text, why):
    good = ("t/msg/Good", ("cdr", "ros2msg"), "float64 data", [numbers(float(k)) for k in range(3)])
    found = read(log([numbers(1.0)], text, kinds=kinds, more={"/good": good}))
    assert found.frames["/good"]["data"].to_list() == [0.0, 1.0, 2.0]
    assert why in found.health.undecodable["/x"]
    with pytest.raises(LogUnreadable, match="none can be decoded"):
        read(log([numbers(1.0)], text, kinds=kinds))


def test_letters_of_an_older_program_are_kept(log):
    """ROS 1 texts are bytes: what is no UTF-8 is taken for Latin-1."""

    def payload(name: bytes) -> bytes:
        return struct.pack("<I", len(name)) + name + struct.pack("<d", 1.5)

    path = log([payload(b"M\xfcritz"), payload("Müritz".encode())], "string ship\nfloat64 x",
               "t/Kind", ("ros1", "ros1msg"))  # fmt: skip
    found = read(path).frames["/x"]
    assert found["ship"].to_list() == ["Müritz", "Müritz"] and found["x"].to_list() == [1.5, 1.5]


def test_ros1_has_no_padding_and_signed_bytes(log):
    text = (
        f"Header header\nbyte b\nchar c\ntime t\nduration d\nfloat64 x{RULE}MSG: std_msgs/Header\n"
    )
    text += "uint32 seq\ntime stamp\nstring frame_id\n"
    payload = struct.pack("<IIII", 1, 1_700_000_000, 7, 3) + b"gps"
    payload += struct.pack("<bBIIiid", -2, 200, 9, 8, -1, 6, 0.25)
    found = read(log([payload], text, "t/Kind", ("ros1", "ros1msg"))).frames["/x"]
    row = found.row(0, named=True)
    assert (row["stamp"], row["header.frame_id"]) == (START + 7, "gps")
    assert (row["b"], row["c"], row["t.sec"], row["d.sec"], row["x"]) == (-2, 200, 9, -1, 0.25)
