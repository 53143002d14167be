"""Schemas and messages made to take for ever: refused with the reason, what is sound is read."""

from __future__ import annotations

import json

import pytest
from google.protobuf import descriptor_pb2
from mcap.records import Schema
from mcap.writer import Writer

from shiplog.exceptions import LogUnreadable
from shiplog.logs.decoding import json_text, messages, protobuf
from shiplog.logs.reading.read import read

START = 1_700_000_000_000_000_000
RULE = "=" * 80
DOUBLE, MESSAGE, OPTIONAL = 1, 11, 1  # of protobuf's descriptors


@pytest.fixture
def log(tmp_path):
    def write(encoding, schema, payloads):
        path = tmp_path / "log.mcap"
        with path.open("wb") as stream:
            writer = Writer(stream)
            writer.start()
            channel = writer.register_channel("/x", encoding, writer.register_schema(*schema))
            for k, payload in enumerate(payloads):
                writer.add_message(channel, START + k, payload, START + k)
            writer.finish()
        return path

    return write


def protobuf_fan(depth: int, width: int) -> bytes:
    """Types of `width` parts each, of which each is of the next type: width^depth fields."""
    file = descriptor_pb2.FileDescriptorProto(name="fan.proto", package="p", syntax="proto3")
    for level in range(depth):
        kind = file.message_type.add(name=f"T{level}")
        for part in range(width):
            field = kind.field.add(name=f"f{part}", number=part + 1, label=OPTIONAL, type=DOUBLE)
            if level + 1 < depth:
                field.type, field.type_name = MESSAGE, f".p.T{level + 1}"
    return descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()


def ros_fan(depth: int, width: int, last: str = "float64 x\n") -> bytes:
    text = "p/T0 root\n"
    for level in range(depth):
        parts = "".join(f"p/T{level + 1} f{part}\n" for part in range(width))
        text += f"{RULE}\nMSG: p/T{level}\n{parts if level + 1 < depth else last}"
    return text.encode()


@pytest.mark.parametrize(
    ("encoding", "schema"),
    [
        ("protobuf", ("p.T0", "protobuf", protobuf_fan(11, 8))),
        ("cdr", ("p/msg/Root", "ros2msg", ros_fan(11, 8))),
        ("cdr", ("p/msg/Root", "ros2msg", ros_fan(11, 8, last=""))),
    ],
    ids=["protobuf", "ros", "ros, of nothing"],
)
def test_a_schema_of_billions_of_fields_is_refused(log, encoding, schema):
    with pytest.raises(LogUnreadable, match=f"it has more than {messages.MOST_FIELDS} fields"):
        read(log(encoding, schema, [bytes(16)]))


@pytest.mark.parametrize(("width", "fields"), [(99, 9900), (100, 10_100)])
def test_how_many_fields_a_schema_may_have(width, fields):
    """Of two types, the parts of the first being of the second."""
    data = protobuf_fan(2, width)
    schema = Schema(id=width, name="p.T0", encoding="protobuf", data=data)
    if fields > messages.MOST_FIELDS:
        with pytest.raises(ValueError, match="more than 10000 fields"):
            protobuf.messages(schema)
    else:
        assert len(protobuf.messages(schema).layout) == width**2


def test_a_schema_of_hundreds_of_fields_is_read(log):
    found = read(log("protobuf", ("p.T0", "protobuf", protobuf_fan(3, 8)), [b""]))
    leaves = [name for name in found.frames["/x"].columns if name.count(".") == 2]
    assert len(leaves) == 8**3


def nested(depth: int, opening: str, closing: str) -> str:
    return opening * (depth - 1) + "1" + closing * (depth - 1)


SOUND = [
    {"x": 1.0, "text": "{[" * 1000}, {"x": 2.0, "list": [{"a": k} for k in range(1000)]},
    {"x": 3.0, "text": '"' + "{" * 100},
]  # fmt: skip


@pytest.mark.parametrize(
    "text",
    [
        '{"a":' + nested(json_text.DEEPEST + 1, "[", "]") + "}",
        nested(json_text.DEEPEST + 2, '{"a":', "}"),
        nested(3000, '{"a":[', "]}"),
        '{"a":' + nested(100_000, "[", "]") + "}",
        json.dumps({f"k{k}": k for k in range(messages.MOST_FIELDS + 1)}),
    ],
    ids=["deep list", "deep object", "both", "deeper than Python goes", "wide"],
)
def test_a_json_message_beyond_any_is_left_out_and_the_others_are_read(log, text):
    payloads = [json.dumps(message).encode() for message in SOUND]
    found = read(log("json", ("j", "jsonschema", b"{}"), [*payloads, text.encode()]))
    assert found.frames["/x"]["x"].to_list() == [1.0, 2.0, 3.0]
    (finding,) = [f for f in found.health.findings if f.kind == "crc"]
    assert finding.sentence == "1 messages on /x do not fit their schema; left out."


def test_a_json_message_just_within_is_read(log):
    deep = '{"b":[1],"a":' + nested(json_text.DEEPEST, "[", "]") + "}"
    found = read(log("json", ("j", "jsonschema", b"{}"), [deep.encode()]))
    assert found.frames["/x"].height == 1 and found.health.findings == ()
