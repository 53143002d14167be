"""Damaged files that claim more than they hold: nothing is held that no log can be."""

from __future__ import annotations

import struct
from collections import Counter

import mcap_bytes as mcap
import pytest
import zstandard
from salvaged_logs import CHUNKS, EACH, GOOD, START, file, numbers, packed, parts, without

from shiplog.exceptions import LogUnreadable
from shiplog.logs.mcap_file import chunks, records, scan


def bomb(size: int, head: bytes = b"", stated: int | None = None, crc: int | None = 0) -> bytes:
    """A chunk of zeros behind `head`, packed to a ten-thousandth."""
    pack = zstandard.ZstdCompressor().compressobj()
    body = pack.compress(head) + pack.compress(bytes(size - len(head))) + pack.flush()
    stated = size if stated is None else stated
    return struct.pack("<QQQI", START, START, stated, crc or 0) + mcap.text("zstd") + (
        struct.pack("<Q", len(body)) + body)  # fmt: skip


@pytest.mark.parametrize(
    "made",
    [bomb(200 << 20), bomb(200 << 20, stated=1000), bomb(64 << 20, stated=2 << 30)],
    ids=["of nothing", "that states less", "that states more"],
)
def test_a_chunk_that_unpacks_to_nothing_is_lost_and_is_never_held(reading, made, monkeypatch):
    held = []
    whole = chunks._pieces
    monkeypatch.setattr(
        chunks, "_pieces", lambda *a: (held.append(len(p)) or p for p in whole(*a)))  # fmt: skip
    header, *rest = parts()
    found = reading(file([header, rest[0], (mcap.CHUNK, made), *rest[1:]]))
    assert numbers(found) == without()
    assert [f.kind for f in found.health.findings] == ["crc"]
    assert max(held) <= chunks.PIECE


def test_a_message_that_is_too_large_is_counted_and_left_out(reading):
    body = mcap.message(1, 7, START, START, b"")
    size = records.LARGEST_MESSAGE + (1 << 20)
    head = struct.pack("<BQ", mcap.MESSAGE, size - 9) + body
    header, *rest = parts()
    found = reading(file([header, rest[0], (mcap.CHUNK, bomb(size, head)), *rest[1:]]))
    assert numbers(found) == without()
    assert found.health.messages_read == CHUNKS * EACH + 1
    (finding,) = [f for f in found.health.findings if f.kind == "crc"]
    assert (finding.channel, finding.value) == ("/gyro", 1.0) and "32 MB" in finding.sentence


def test_more_messages_than_a_file_of_its_size_holds_are_counted_and_left_out(reading, monkeypatch):
    monkeypatch.setattr("shiplog.logs.decoding.tables.LEAST_ROWS", 60)
    monkeypatch.setattr("shiplog.logs.decoding.tables.ROWS_PER_BYTE", 0.0)
    found = reading(GOOD)
    assert found.health.messages_read == CHUNKS * EACH
    assert sum(frame.height for frame in found.frames.values()) <= 60
    assert {f.kind for f in found.health.findings} == {"crc"}


def test_a_log_of_nothing_but_too_many_messages_is_refused_with_the_reason(reading, monkeypatch):
    monkeypatch.setattr("shiplog.logs.decoding.tables.LEAST_ROWS", 0)
    monkeypatch.setattr("shiplog.logs.decoding.tables.ROWS_PER_BYTE", 0.0)
    with pytest.raises(LogUnreadable, match="more than a log of its size can hold"):
        reading(GOOD)


def test_a_chunk_of_more_messages_than_a_log_can_hold_is_counted_and_none_is_made(
    reading, monkeypatch
):
    """Empty messages on two channels, packed to nothing; the sound log around them is read."""
    monkeypatch.setattr("shiplog.logs.decoding.tables.LEAST_ROWS", 1000)
    monkeypatch.setattr("shiplog.logs.decoding.tables.ROWS_PER_BYTE", 0.0)
    made = Counter()
    whole = records.record
    monkeypatch.setattr(
        records, "record", lambda opcode, *a: (made.update([opcode]), whole(opcode, *a))[1]
    )
    empty = b"".join(
        mcap.record(mcap.MESSAGE, mcap.message(n, 0, START, START, b"")) for n in (1, 2, 1, 1)
    )
    header, *rest = parts()
    found = reading(file([header, rest[0], (mcap.CHUNK, packed(empty * 5000, 0, 0)), *rest[1:]]))
    assert numbers(found) == without()
    assert found.health.messages_read == CHUNKS * EACH + 20_000
    assert made[mcap.MESSAGE] == CHUNKS * EACH
    told = {f.channel: f for f in found.health.findings if f.kind == "crc"}
    assert {topic: f.value for topic, f in told.items()} == {"/gyro": 15_000, "/wind": 5000}
    assert "are more than a log of this size can hold; left out" in told["/gyro"].sentence


def test_unpacking_ends_where_a_log_of_this_size_cannot_go_on(reading, monkeypatch):
    monkeypatch.setattr(scan, "MOST_WORK", 2000)
    monkeypatch.setattr(scan, "MOST_RATIO", 0)
    found = reading(GOOD)
    assert 0 < found.health.messages_read < CHUNKS * EACH
    assert "unpacks to far more" in found.health.findings[0].sentence
