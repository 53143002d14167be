"""Rows of a log that grows, against those that `ingest` makes of it afterwards."""

from __future__ import annotations

import itertools
import struct

import numpy as np
import polars as pl
import pytest
from growing import written

from shiplog.live.causal_rows import CausalRows
from shiplog.live.messages import Inflow, Window
from shiplog.live.sources import opened
from shiplog.live.sources.mcap_file import McapFile
from shiplog.live.sources.rotated_folder import RotatedFolder
from shiplog.ship_profile import file as profiles
from shiplog.voyages.ingest import ingest
from shiplog.voyages.samples import fields_read

PROFILE = profiles.load("esso-vectwin")
WANTED = fields_read.wanted(PROFILE, {})
DIFFER = 0.01  # share of the rows that may differ in a value or a mark


@pytest.fixture(scope="module")
def log() -> bytes:
    return written("voyage_4", 600.0, 634.0)  # 3 s without GNSS are in it


def followed(source, feed, slice_s=5.0):
    """Rows of all that a source gives while `feed` lets it grow, and the events of each look."""
    window, inflow, rows = Window(90.0), Inflow(), CausalRows(PROFILE, "growing")
    final, looks, notes = [], [], []
    for _ in feed:
        arrived = source.look(0)
        notes += arrived.notes
        window.topics |= arrived.topics
        window.metadata = {k: dict(v) for k, v in arrived.metadata.items()}
        inflow.add(arrived.frames)
        while inflow:
            window.add(inflow.take(slice_s))
            if (found := rows.look(window)) is not None:
                final.append(found.final)
                looks.append((window.newest, found))
    if (last := rows.look(window, end=True)) is not None:
        final.append(last.final)
    return pl.concat(final), looks, notes


def grown(path, content: bytes, pieces: int):
    """The file, piece by piece: most of them end within a record."""
    edges = np.linspace(0, len(content), pieces + 1).astype(int)
    path.write_bytes(b"")
    for a, b in itertools.pairwise(edges):
        with path.open("ab") as stream:
            stream.write(content[a:b])
        yield


def differing(one: pl.DataFrame, other: pl.DataFrame) -> float:
    """Share of the rows of `one` whose value or mark is another, or missing."""
    both = one.join(other, on="time", how="left", suffix=":live")
    bad = np.zeros(both.height, bool)
    for name in (*PROFILE.columns, "quality"):
        a, b = (both[n].cast(pl.Float64).fill_null(np.nan).to_numpy() for n in (
            name, f"{name}:live"))  # fmt: skip
        bad |= ~np.isclose(a, b, rtol=1e-6, atol=1e-9, equal_nan=True)
    return float(bad.mean())


def test_rows_are_those_of_ingest_afterwards(tmp_path, log):
    path = tmp_path / "growing.mcap"
    live, looks, notes = followed(McapFile(path, WANTED), grown(path, log, 9))
    whole = ingest.ingest(path, PROFILE).table
    assert not notes
    assert live.height == whole.height == live["time"].n_unique()
    assert (whole["quality"] != 0).any()  # the gap is among the rows that are compared
    assert differing(whole, live) <= DIFFER
    # until they are final, rows are provisional, and behind the messages by a sample or two; where
    # a channel has just fallen silent they wait a second for it
    late = [newest - int(rows.provisional["time"].to_physical()[-1]) for newest, rows in looks]
    assert np.median(late) < 300_000_000 and max(late) < 1_300_000_000
    for _, rows in looks:
        assert rows.final.is_empty() or rows.final["time"][-1] < rows.provisional["time"][0]


@pytest.mark.long
def test_a_row_is_revised_when_a_rule_hears_of_it(tmp_path, log):
    """A sensor that begins to repeat itself is known to only after seconds: rows that were good
    when they were shown are marked, and counted as revised."""
    path = tmp_path / "held.mcap"
    window, rows = Window(90.0), CausalRows(PROFILE, "held")
    path.write_bytes(log)
    source = McapFile(path, WANTED)
    inflow = Inflow()
    inflow.add(source.look(0).frames)
    until, revised = 0, 0
    while inflow:
        frames = inflow.take(2.0)
        until = until or min(int(f["log_time"][0]) for f in frames.values()) + 20 * 10**9
        gyro = frames.get("/gyro")
        if gyro is not None:
            late = pl.col("log_time") > until
            frames["/gyro"] = gyro.with_columns(
                pl.when(late).then(123.0).otherwise(pl.col("heading_deg")).alias("heading_deg")
            )
        window.add(frames)
        found = rows.look(window)
        revised += 0 if found is None else found.revised
    assert revised > 10


def test_a_file_that_is_cut_short_begins_again(tmp_path, log):
    path = tmp_path / "cut.mcap"
    path.write_bytes(log[:40_000])
    source = McapFile(path, WANTED)
    first = source.look(0)
    assert first.count and not first.anew
    path.write_bytes(log[:15_000])
    again = source.look(0)
    assert again.anew and again.count and "cut short" in again.notes[0]
    path.unlink()
    assert "is not there" in source.look(0).notes[0]


def within_a_chunk(log: bytes) -> int:
    """A byte of the packed records of a chunk in the second half of a log."""
    at = 8
    while True:
        opcode, length = struct.unpack_from("<BQ", log, at)
        if opcode == 6 and at > len(log) // 2:
            return at + 9 + length - 20
        at += 9 + length


def test_a_damaged_chunk_costs_itself_alone(tmp_path, log):
    path = tmp_path / "damaged.mcap"
    broken = bytearray(log)
    broken[within_a_chunk(log)] ^= 0xFF
    path.write_bytes(bytes(broken))
    damaged = McapFile(path, WANTED).look(0)
    path.write_bytes(log)
    whole = McapFile(path, WANTED).look(0)
    assert damaged.notes and damaged.ended
    assert 0.8 * whole.count < damaged.count < whole.count


def test_bytes_that_are_no_record_end_the_file_in_words(tmp_path, log):
    path = tmp_path / "zeros.mcap"
    path.write_bytes(log[:20_000] + bytes(1000))
    source = McapFile(path, WANTED)
    notes = [note for _ in range(40) for note in source.look(0).notes]
    assert len(notes) == 1 and "no record" in notes[0]
    path.write_bytes(b"not a log at all")
    assert source.look(0).notes


@pytest.mark.long
def test_a_rotated_folder_is_one_voyage(tmp_path, log):
    folder = tmp_path / "recorder"
    folder.mkdir()
    halves = written("voyage_4", 600.0, 617.0), written("voyage_4", 617.0, 634.0)

    def rotated():
        for number, half in enumerate(halves):
            yield from grown(folder / f"part_{number}.mcap", half, 2)
            yield
        yield

    live, _, _ = followed(RotatedFolder(folder, WANTED), rotated())
    (tmp_path / "whole.mcap").write_bytes(log)
    whole = ingest.ingest(tmp_path / "whole.mcap", PROFILE).table
    assert differing(whole, live) <= DIFFER
    assert sorted(p.name for p in folder.iterdir()) == ["part_0.mcap", "part_1.mcap"]


def test_a_source_that_is_none_is_refused(tmp_path):
    with pytest.raises(Exception, match="no source"):
        opened(str(tmp_path / "nothing.bin"), WANTED)
