"""Damaged and hostile logs: what is lost is counted, and nothing else is."""

from __future__ import annotations

import contextlib
import random
import struct
from pathlib import Path

import polars as pl
import pytest
from made_logs import COUNT, chunks, kinds, protobuf_log
from mcap.writer import CompressionType
from polars.testing import assert_frame_equal

from shiplog.exceptions import LogUnreadable
from shiplog.logs.reading.check import check
from shiplog.logs.reading.read import contents, fields, read


def test_damaged_and_whole_logs_agree_on_what_both_have(good, tmp_path):
    where, size, lost = chunks(good)[1]
    data = bytearray(good.read_bytes())
    data[where + size // 2] ^= 0xFF
    path = tmp_path / "flipped.mcap"
    path.write_bytes(data)
    found, whole = read(path), read(good)
    assert found.health.route == "salvage"
    for topic, frame in found.frames.items():
        kept = whole.frames[topic].filter(pl.col("log_time").is_in(frame["log_time"].implode()))
        assert_frame_equal(frame, kept)
    assert sum(f.height for f in found.frames.values()) == COUNT - lost


@pytest.mark.parametrize("which", [0, 2, -1], ids=["first", "middle", "last"])
def test_a_flipped_byte_costs_its_chunk_and_no_more(good, tmp_path, which):
    where, size, lost = chunks(good)[which]
    data = bytearray(good.read_bytes())
    data[where + size // 2] ^= 0xFF
    path = tmp_path / "flipped.mcap"
    path.write_bytes(data)
    health = read(path).health
    assert (health.messages_read, health.messages_lost) == (COUNT - lost, lost)
    assert (health.chunks, health.chunks_lost) == (len(chunks(good)), 1)
    (finding,) = [f for f in health.findings if f.kind == "crc"]
    assert finding.start_s is not None
    assert finding.end_s is not None and finding.end_s > finding.start_s


def test_a_payload_that_does_not_match_its_checksum_is_refused(tmp_path):
    path = protobuf_log(tmp_path / "plain.mcap", compression=CompressionType.NONE)
    where, size, lost = chunks(path)[1]
    data = bytearray(path.read_bytes())
    data[where + size - 20] ^= 0x01
    path.write_bytes(data)
    health = read(path).health
    assert (health.messages_read, health.messages_lost) == (COUNT - lost, lost)
    assert kinds(read(path)) == ["crc"]


def test_everything_before_a_cut_is_kept(good, tmp_path):
    data = good.read_bytes()
    pieces = chunks(good)
    where, size, _ = pieces[3]
    path = tmp_path / "cut.mcap"
    path.write_bytes(data[: where + size // 2])
    found = read(path)
    assert found.health.messages_read == sum(count for _, _, count in pieces[:3])
    assert (found.health.messages_lost, found.health.route) == (None, "salvage")
    (finding,) = found.health.findings
    assert finding.kind == "truncated"
    assert contents(path).topics["/a"].messages == found.frames["/a"].height


def test_a_log_cut_in_its_summary_loses_nothing(good, tmp_path):
    path = tmp_path / "cut.mcap"
    path.write_bytes(good.read_bytes()[:-200])
    found = read(path)
    assert found.health.messages_read == COUNT
    assert kinds(found) == ["truncated"]


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "empty"),
        (b"\x89MCA", "cut off"),
        (b"\x89MCAP0\r\n", "recovered"),
        (b"PAR1" + bytes(40), "shiplog convert"),
        (b"time,x\n1,2\n" * 9, "74 69 6D 65"),
        (b"\x89MCAP0\n" + bytes(40), "line-ending"),
    ],
    ids=["zero bytes", "cut magic", "only magic", "parquet", "csv", "stripped CR"],
)
def test_what_is_no_log_is_refused_with_a_reason(tmp_path, content, says):
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(LogUnreadable, match=says):
        read(path)


def test_an_empty_log_and_a_missing_one_are_refused(tmp_path):
    path = protobuf_log(tmp_path / "none.mcap", count=0)
    with pytest.raises(LogUnreadable, match="no messages"):
        read(path)
    assert contents(path).topics["/a"].messages == 0
    for wrong in (tmp_path, tmp_path / "absent.mcap"):
        with pytest.raises(LogUnreadable):
            read(wrong)


def test_stated_sizes_are_not_believed(good, tmp_path):
    """A chunk that claims 512 MB and a record that claims 2 EB are damage, not allocations."""
    where, _, lost = chunks(good)[1]
    data = bytearray(good.read_bytes())
    head = where - 8 - 4 - 4 - 4 - 8  # the uncompressed size, before CRC, "zstd" and the length
    assert struct.unpack_from("<Q", data, head)[0] < 40_000
    struct.pack_into("<Q", data, head, 512 << 20)
    path = tmp_path / "bomb.mcap"
    path.write_bytes(data)
    assert read(path).health.messages_lost == lost
    struct.pack_into("<Q", data, head - 24, 2 << 60)  # the record's own length
    path.write_bytes(data)
    assert read(path).health.messages_lost == lost  # found again through the chunk index


def small(path: Path, **options) -> Path:
    return protobuf_log(path, count=300, topics=("/a", "/b"), chunk_size=4096, **options)


@pytest.mark.parametrize("chunked", [True, False], ids=["chunks", "no chunks"])
def test_random_damage_never_raises_anything_else_and_never_adds_messages(tmp_path, chunked):
    whole = small(tmp_path / "whole.mcap", use_chunking=chunked).read_bytes()
    chance = random.Random(1)
    path = tmp_path / "damaged.mcap"
    for _ in range(30):
        flipped = bytearray(whole)
        flipped[chance.randrange(len(whole))] ^= 1 << chance.randrange(8)
        for data in (flipped, whole[: chance.randrange(len(whole))]):
            path.write_bytes(data)
            try:
                found = read(path)
                check(path)
            except LogUnreadable:
                continue
            finally:
                with contextlib.suppress(LogUnreadable):
                    contents(path)
                    fields(path)
            assert found.health.messages_read <= 300
            assert sum(f.height for f in found.frames.values()) <= 300
