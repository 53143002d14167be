"""Many protobuf messages at once: the same numbers, nulls and failures as by the package."""

from __future__ import annotations

import random
from collections import defaultdict
from collections.abc import Sequence

import numpy as np
import pytest
from google.protobuf import descriptor_pb2 as pb
from made_logs import DESCRIPTORS, KIND, Kind, sample
from mcap.records import Schema
from polars.testing import assert_frame_equal

from shiplog.logs.decoding import protobuf
from shiplog.logs.decoding.protobuf_layout import FlatMessages

NUMBERS = (
    "timestamp.seconds", "timestamp.nanos", "value", "small", "signed", "negative", "large", "on",
    "point.x", "point.y", "point.z", "fixed", "maybe",
)  # fmt: skip


def reader() -> protobuf.ProtobufMessages:
    return protobuf.messages(Schema(1, DESCRIPTORS, "protobuf", "t.Kind"))


def other_kind(*, demanding: bool = False) -> protobuf.ProtobufMessages:
    """A choice of two numbers, a map and a list of integers; or one field that must be sent."""
    file = pb.FileDescriptorProto(name="o.proto", package="o", syntax="proto2")
    kind = file.message_type.add(name="Other")
    if demanding:
        kind.field.add(name="x", number=1, type=KIND.TYPE_DOUBLE, label=KIND.LABEL_REQUIRED)
    else:
        file.syntax = "proto3"
        kind.oneof_decl.add(name="choice")
        for number, name in ((1, "x"), (2, "y")):
            kind.field.add(name=name, number=number, type=KIND.TYPE_DOUBLE, label=1, oneof_index=0)
        entry = kind.nested_type.add(name="NamesEntry")
        entry.options.map_entry = True
        for number, name in ((1, "key"), (2, "value")):
            entry.field.add(name=name, number=number, type=KIND.TYPE_STRING, label=1)
        kind.field.add(name="names", number=3, type=KIND.TYPE_MESSAGE, label=3,
                       type_name=".o.Other.NamesEntry")  # fmt: skip
        kind.field.add(name="whole", number=4, type=KIND.TYPE_INT64, label=3)
        inner = file.message_type.add(name="Inner")
        inner.oneof_decl.add(name="choice")
        for number, name in ((1, "a"), (2, "b")):
            inner.field.add(name=name, number=number, type=KIND.TYPE_DOUBLE, label=1, oneof_index=0)
        kind.field.add(
            name="inner", number=6, type=KIND.TYPE_MESSAGE, label=1, type_name=".o.Inner"
        )
        kind.field.add(name="z", number=5, type=KIND.TYPE_INT32, label=1)
    described = pb.FileDescriptorSet(file=[file]).SerializeToString()
    return protobuf.messages(Schema(1, described, "protobuf", "o.Other"))


def at_once(flat: FlatMessages, payloads: Sequence[bytes]):
    groups = defaultdict(list)
    for row, payload in enumerate(payloads):
        matrix = np.frombuffer(payload, np.uint8).reshape(1, -1)
        groups[len(payload)].append((np.array([row]), matrix))
    return flat.columns(len(payloads), groups)


def assert_as_the_package(
    payloads: Sequence[bytes],
    leaves: Sequence[str] = NUMBERS,
    whole: protobuf.ProtobufMessages | None = None,
):
    whole = whole or reader()
    flat = whole.flat(leaves)
    assert flat is not None
    frame, bad = at_once(flat, payloads)
    expected, failed = whole.columns(payloads, leaves)
    assert bad.tolist() == failed.tolist()
    assert_frame_equal(frame, expected)
    return frame, bad


def plain(k: int) -> bytes:
    """Message k in ASCII: what `sample` makes has a letter that only the package may judge."""
    message = sample(k)
    message.MergeFrom(Kind(frame_id=f"ship {k % 10}"))
    return message.SerializeToString()


@pytest.fixture
def asked(monkeypatch):
    """The payloads that were left to the package."""
    met: list[bytes] = []
    whole = protobuf.ProtobufMessages.columns

    def watched(self, payloads, leaves):
        met.extend(payloads)
        return whole(self, payloads, leaves)

    monkeypatch.setattr(protobuf.ProtobufMessages, "columns", watched)
    return met


def test_messages_whose_fields_come_and_go(asked):
    payloads = [plain(k) for k in range(500)]
    frame, _ = assert_as_the_package(payloads)
    assert frame["point.x"].null_count() == 375 and frame["maybe"].null_count() == 400
    assert asked == payloads  # once, by the comparison


def test_letters_beyond_ascii_are_the_packages_to_judge(asked):
    payloads = [sample(k).SerializeToString() for k in range(20)]
    assert_as_the_package(payloads)
    assert len(asked) == 40


@pytest.mark.parametrize(
    ("field", "values"),
    [
        ("value", [0.0, -0.0, 5e-324, float("inf"), float("nan"), -1.5]),
        ("small", [0.0, 1.5, float("-inf"), 2.0**-149]),
        ("signed", [0, 1, -1, 2**31 - 1, -(2**31), 64, -64]),
        ("negative", [0, 1, -1, 2**63 - 1, -(2**63), 127, 128]),
        ("large", [0, 1, 2**64 - 1, 2**63, 127, 128, 2**35]),
        ("fixed", [0, 1, -1, 2**31 - 1, -(2**31)]),
        ("on", [True, False]),
        ("maybe", [0.0, 1.0]),
    ],
)
def test_every_number_comes_back(field, values):
    messages = [Kind(**{field: value}) for value in values]
    frame, bad = assert_as_the_package([m.SerializeToString() for m in messages])
    assert not bad.any()
    expected = [getattr(m, field) for m in messages]
    np.testing.assert_array_equal(frame[field].to_numpy(), np.array(expected))


STAMP = b"\x0a\x02\x08\x07"  # timestamp { seconds: 7 }
ODD = {
    "a field twice": b"\x11" + bytes(8) + b"\x11" + np.float64(2.0).tobytes(),
    "a message twice": STAMP + b"\x0a\x02\x10\x05",
    "a tag in two bytes more than it needs": b"\x91\x80\x00" + bytes(8),
    "a length longer than it needs": b"\x0a\x82\x00\x08\x07",
    "a tag in more bytes than a tag may have": b"\x91\x80\x80\x80\x80\x00" + bytes(8),
    "a length in more bytes than it may have": b"\x0a\x82\x80\x80\x80\x80\x00\x08\x07",
    "a number longer than it needs": b"\x20\x81\x00",
    "eleven bytes of a number": b"\x28" + b"\xff" * 10 + b"\x01",
    "ten bytes, too large": b"\x28" + b"\xff" * 9 + b"\x02",
    "ten bytes, the largest": b"\x28" + b"\xff" * 9 + b"\x01",
    "33 bits for 32": b"\x20\xff\xff\xff\xff\x1f",
    "a bool of 256": b"\x38\x80\x02",
    "another wire type": b"\x10\x05",
    "a text where a number should be": b"\x12\x02ab",
    "a newer field": b"\xf8\x07\x05" + STAMP,
    "a newer field, cut": b"\xfa\x07\x05ab",
    "a group": b"\xfb\x07\xfc\x07" + STAMP,
    "the end of a group": b"\xfc\x07",
    "field number 0": b"\x00\x05",
    "a wire type that is none": b"\x16",
    "cut in a tag": b"\x91",
    "cut in a number": b"\x11\x00\x00",
    "cut in a message": b"\x0a\x05\x08\x07",
    "a message that ends in a number": b"\x0a\x01\x08",
    "no UTF-8": b"\x42\x02\xff\xfe",
    "UTF-8": b"\x42\x02\xc3\xbc" + STAMP,
    "a list of doubles": b"\x62\x10" + bytes(16),
    "a list of doubles, cut": b"\x62\x0f" + bytes(15),
    "a list, one by one": b"\x61" + bytes(8) + b"\x61" + bytes(8) + STAMP,
    "a list of messages": b"\x5a\x09\x09" + bytes(8) + b"\x5a\x00" + STAMP,
    "a list of broken messages": b"\x5a\x02\x09\x00" + STAMP,
    "nothing": b"",
}


@pytest.mark.parametrize("payload", ODD.values(), ids=ODD)
def test_what_is_odd_is_as_the_package_has_it(payload):
    """First, when its layout may be learned, and after others of its length were."""
    assert_as_the_package([payload])
    assert_as_the_package([payload, payload, plain(1), payload])
    twin = bytearray(payload)
    for place in range(len(payload)):
        for bit in (0x01, 0x80):
            twin[place] ^= bit
            assert_as_the_package([payload, bytes(twin), payload])
            assert_as_the_package([bytes(twin), payload])
            twin[place] ^= bit


DOUBLE = {k: np.float64(k).tobytes() for k in (1, 2)}


@pytest.mark.parametrize(
    "payload",
    [
        b"\x09" + DOUBLE[1], b"\x11" + DOUBLE[2], b"\x09" + DOUBLE[1] + b"\x11" + DOUBLE[2],
        b"\x11" + DOUBLE[2] + b"\x09" + DOUBLE[1], b"\x1a\x06\x0a\x01k\x12\x01v\x28\x07",
        b"\x1a\x06\x0a\x01\xff\x12\x01v\x28\x07", b"\x22\x03\x01\x80\x01\x28\x07",
        b"\x22\x02\x01\x80\x28\x07", b"\x20\x01\x20\x02\x28\x07",
        b"\x22\x0b" + b"\xff" * 10 + b"\x01\x28\x07", b"\x22\x03\x01\x01\x01\x28\x07",
        b"\x32\x09\x09" + DOUBLE[1] + b"\x32\x09\x11" + DOUBLE[2],
    ],
    ids=["x", "y", "x, then y", "y, then x", "a map", "a map of no UTF-8", "a list",
         "a list, cut", "one by one", "a long number", "three", "merged"],
)  # fmt: skip
def test_choices_maps_and_lists_are_as_the_package_has_them(payload):
    """Of a choice the last one counts."""
    whole = other_kind()
    leaves = ["x", "y", "z", "inner.a", "inner.b"]
    assert_as_the_package([payload], leaves, whole)
    twin = bytearray(payload)
    for place in range(len(payload)):
        twin[place] ^= 0x80
        assert_as_the_package([payload, b"\x28\x05", bytes(twin), payload], leaves, whole)
        twin[place] ^= 0x80


def test_a_field_that_must_be_sent_is_the_packages_to_miss():
    assert other_kind(demanding=True).flat(["x"]) is None
    assert other_kind().flat(["x"]) is not None


def test_damaged_bytes_are_as_the_package_has_them():
    chance = random.Random(5)
    whole = reader()
    flat = whole.flat(NUMBERS)
    assert flat is not None
    for _ in range(150):  # the layouts that were learned stay
        payloads = [bytearray(plain(chance.randrange(60))) for _ in range(20)]
        for payload in payloads[::2]:
            for _ in range(chance.randrange(1, 4)):
                payload[chance.randrange(len(payload))] = chance.randrange(256)
        made = [bytes(p[: chance.randrange(len(p))] if chance.random() < 0.1 else p)
                for p in payloads]  # fmt: skip
        frame, bad = at_once(flat, made)
        expected, failed = whole.columns(made, NUMBERS)
        assert bad.tolist() == failed.tolist()
        assert_frame_equal(frame, expected)


def test_more_layouts_than_it_keeps(monkeypatch, asked):
    monkeypatch.setattr("shiplog.logs.decoding.protobuf_layout.MOST_LAYOUTS", 2)
    payloads = [plain(k) for k in range(200)]
    assert_as_the_package(payloads)
    assert len(asked) > 200


def test_only_numbers_are_taken():
    assert reader().flat(["value", "frame_id"]) is None
    assert reader().flat(["colour"]) is None  # an enum may be closed
    assert reader().flat(["covariance"]) is None
    assert reader().flat([]) is not None
