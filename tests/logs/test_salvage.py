"""Damaged files: what a search can find is read, and what is lost is reported by topic and time."""

from __future__ import annotations

import random
import struct
import zlib

import mcap_bytes as mcap
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from salvaged_logs import (
    CHUNK_AT,
    CHUNKS,
    EACH,
    GOOD,
    SECOND,
    START,
    TOPICS,
    changed,
    described,
    file,
    numbers,
    packed,
    parts,
    payload,
    places,
    without,
)

from shiplog.exceptions import LogUnreadable
from shiplog.logs.mcap_file import scan
from shiplog.logs.reading.read import contents, read

DAMAGE = {  # the file, and the chunks of which nothing can be read
    "whole": (GOOD, ()),
    "an index that claims to be the end": (
        changed(GOOD, places(GOOD, mcap.MESSAGE_INDEX)[0][0], bytes([mcap.DATA_END])), ()),
    "an index that claims to be a footer": (
        changed(GOOD, places(GOOD, mcap.MESSAGE_INDEX)[0][0], bytes([mcap.FOOTER])), ()),
    "a length beyond the file": (changed(GOOD, CHUNK_AT[3][0] + 4, b"\x10"), (3,)),
    "a length within the file": (changed(GOOD, CHUNK_AT[3][0] + 2, b"\x02"), ()),
    "a chunk that states 8 EB": (changed(GOOD, CHUNK_AT[3][0] + 25, b"\0" * 7 + b"\x7f"), (3,)),
    "a byte missing": (GOOD[: CHUNK_AT[3][0] + 50] + GOOD[CHUNK_AT[3][0] + 51 :], (3,)),
    "a byte inserted": (GOOD[: CHUNK_AT[3][0] + 50] + b"x" + GOOD[CHUNK_AT[3][0] + 50 :], (3,)),
    "a byte inserted between chunks": (GOOD[: CHUNK_AT[3][0]] + b"x" + GOOD[CHUNK_AT[3][0] :], ()),
    "zeros over two chunks": (
        changed(GOOD, CHUNK_AT[3][0], bytes(CHUNK_AT[5][0] - CHUNK_AT[3][0])), (3, 4)),
    "a chunk that fails its CRC": (changed(GOOD, CHUNK_AT[3][0] + 33, b"\x00\x00"), (3,)),
    "no magic": (GOOD[8:], ()),
    "bytes before the magic": (b"\xef\xbb\xbf" + GOOD, ()),
    "cut off in the last chunk": (GOOD[: CHUNK_AT[9][0] + 60], (9,)),
    "bytes behind the end": (GOOD + bytes(5000), ()),
}  # fmt: skip


@pytest.mark.parametrize("name", DAMAGE)
def test_all_that_a_search_can_find_is_read(reading, name):
    data, lost = DAMAGE[name]
    found = reading(data)
    assert numbers(found) == without(*lost)
    assert found.health.messages_read == len(without(*lost))
    kinds = {f.kind for f in found.health.findings}
    harmless = name == "whole" or name.startswith("an index")
    assert bool(kinds & {"crc", "truncated"}) == (not harmless)


def test_a_lost_chunk_is_named_by_topic_number_and_time(reading):
    found = reading(DAMAGE["a chunk that fails its CRC"][0])
    (finding,) = found.health.findings
    assert "its 12 messages on /gyro, /rudder, /wind from 36.0 s to 47.0 s are lost" in (
        finding.sentence
    )
    assert (finding.start_s, finding.end_s) == (36.0, 47.0)


def test_a_loss_that_has_no_times_lies_between_its_neighbours(reading):
    (finding, *_) = reading(DAMAGE["zeros over two chunks"][0]).health.findings
    assert (finding.start_s, finding.end_s) == (35.0, 60.0)


def test_two_logs_one_behind_the_other_are_both_read(reading):
    """Their channels have the same numbers and other topics."""
    other = tuple(reversed(TOPICS))
    found = reading(GOOD + file(parts(other)))
    assert numbers(found) == sorted(2 * without())
    assert found.frames["/gyro"].height == 80
    by_number = {k: "/gyro" for k in range(0, 120, 3)} | {k: "/rudder" for k in range(2, 120, 3)}
    first = sorted(k for k in by_number if by_number[k] == "/gyro")
    second = sorted(k for k in range(2, 120, 3))
    assert sorted(int(x) for x in found.frames["/gyro"]["x"]) == sorted(first + second)
    assert any("2 logs" in f.sentence for f in found.health.findings)
    assert found.health.messages_lost == 0


def test_the_second_log_is_read_where_the_first_was_cut_off(reading):
    found = reading(GOOD[: CHUNK_AT[9][0] + 60] + file(parts(tuple(reversed(TOPICS)))))
    assert numbers(found) == sorted(without(9) + without())
    assert sorted(int(x) for x in found.frames["/wind"]["x"]) == sorted(
        [k for k in without(9) if k % 3 == 1] + list(range(1, 120, 3))
    )


@pytest.mark.parametrize("bit", [3, 40, 100, -20])
def test_a_damaged_summary_still_describes_channels_whose_first_chunk_is_lost(reading, bit):
    made = parts()
    made[1] = (mcap.CHUNK, b"\0" * 40 + made[1][1][40:])
    summary = described() + mcap.record(mcap.STATISTICS, bytes(46))
    whole = file(made, summary)
    assert numbers(reading(whole)) == without(0)
    at = len(whole) - 37 + bit if bit < 0 else whole.index(summary, 500) + bit
    found = reading(changed(whole, at, bytes([whole[at] ^ 0x20])), "spoilt.mcap")
    spoilt = {3: 1, 40: 2, 100: 3}.get(bit)  # the channel whose only copy was hit
    assert numbers(found) == [k for k in without(0) if spoilt is None or k % 3 + 1 != spoilt]
    assert found.health.findings


def test_a_description_that_a_crc_vouches_for_is_taken_before_one_that_none_does(reading):
    data = file(parts(), described(("/gyrp", "/winp", "/rudda")))
    end = len(data) - 12
    found = reading(changed(data, end, bytes([data[end] ^ 1])))  # the summary's CRC
    assert set(found.frames) == set(TOPICS)


def test_a_topic_that_is_no_text_costs_nothing(reading):
    found = reading(file(parts((b"/\xff\xfe", "/wind", "/rudder"))))
    assert found.health.messages_read == CHUNKS * EACH
    assert set(found.frames) == {"/\\xff\\xfe", "/wind", "/rudder"}


def test_descriptions_may_stand_behind_the_messages_that_need_them(reading):
    header, first, *rest = parts()
    assert numbers(reading(file([header, *reversed(rest), first]))) == without()


def test_offsets_that_no_file_has_are_damage(reading):
    for big in (2**62, 2**63, 2**64 - 1):
        summary = described() + mcap.record(
            mcap.METADATA_INDEX, struct.pack("<QQ", big, 1) + mcap.text("x")
        )
        summary += mcap.record(
            mcap.CHUNK_INDEX,
            struct.pack("<QQQQ", 0, 1, big, big) + mcap.numbers({}) + struct.pack("<Q", 0)
            + mcap.text("") + struct.pack("<QQ", 1, 1),
        )  # fmt: skip
        assert numbers(reading(file(parts(), summary))) == without()


def indexed(made: list[tuple[int, bytes]], off: int = 0) -> bytes:
    """A summary that says where each chunk stands, or so many bytes further on."""
    found = described()
    for at, length in places(file(made), mcap.CHUNK):
        body = struct.pack("<QQQQ", START, START, at + off, length) + mcap.numbers({})
        body += struct.pack("<Q", 0) + mcap.text("zstd") + struct.pack("<QQ", length, length)
        found += mcap.record(mcap.CHUNK_INDEX, body)
    return found


@pytest.mark.parametrize("broken", ["its checksum", "its last record", "the footer"])
@pytest.mark.parametrize(("off", "lost"), [(0, ()), (7, (3,))], ids=["true", "false"])
def test_a_damaged_summary_still_says_where_a_chunk_without_a_head_stands(
    reading, broken, off, lost
):
    """Its word is taken where the chunk's own CRC bears it out, and only there."""
    whole = file(parts(), indexed(parts(), off))
    at = CHUNK_AT[3][0]
    data = changed(whole, at, b"\x07\x05")  # an index of five bytes
    spoilt = {"its checksum": -12, "its last record": -37 - 20, "the footer": -37}[broken]
    place = len(data) + spoilt
    found = reading(changed(data, place, bytes([data[place] ^ 0x20])))
    assert numbers(found) == without(*lost)
    assert "crc" in {f.kind for f in found.health.findings} or broken == "the footer"
    assert found.health.findings


def test_a_damaged_summary_is_not_believed_of_a_chunk_without_a_checksum(reading):
    """Nothing bears its word out: any bytes would be taken for a chunk."""
    made = parts()
    at = [i for i, (kind, _) in enumerate(made) if kind == mcap.CHUNK][3]
    made[at] = (mcap.CHUNK, changed(made[at][1], 24, bytes(4)))
    whole = file(made, indexed(made))
    assert numbers(reading(whole)) == without()
    place = CHUNK_AT[3][0]
    data = changed(whole, place, b"\x07\x05")
    data = changed(data, len(data) - 12, bytes([data[-12] ^ 0x20]))
    assert numbers(reading(data, "spoilt.mcap")) == without(3)


def test_a_chunk_whose_checksum_is_wrong_is_not_read_even_where_it_is_all_there_is(reading):
    """One of its bytes is wrong, and nothing says which: the log is refused with that reason."""
    header, first, *_ = parts()
    raw = zstandard.ZstdDecompressor().decompress(first[1][44:])
    wrong = (mcap.CHUNK, packed(raw, 0, EACH - 1, crc=zlib.crc32(raw) ^ 1))
    with pytest.raises(LogUnreadable, match="does not match its checksum"):
        reading(file([header, wrong]))
    second = parts()[3 + len(TOPICS) - 1]
    assert second[0] == mcap.CHUNK
    with_sound = reading(file([header, wrong, second], described()), "two.mcap")
    assert numbers(with_sound) == list(range(EACH, 2 * EACH))
    with pytest.raises(LogUnreadable, match="does not have the size it states"):
        short = (mcap.CHUNK, packed(raw, 0, EACH - 1, size=len(raw) - 1))
        reading(file([header, short]), "no.mcap")


@pytest.mark.parametrize("opcode", [k for k in range(1, 256, 7)] + list(range(1, 16)))
def test_a_chunk_of_which_only_the_opcode_is_damaged_is_read(reading, opcode):
    """In a log without a summary nothing else says that it is one."""
    assert numbers(reading(changed(GOOD, CHUNK_AT[3][0], bytes([opcode])))) == without()


@pytest.mark.parametrize("opcode", [mcap.HEADER, mcap.SCHEMA, mcap.CHANNEL, mcap.MESSAGE, ord("x")])
@pytest.mark.parametrize("how", ["insert", "overwrite"])
def test_what_looks_like_a_record_outside_chunks_hides_no_chunk(reading, opcode, how):
    """A byte in front of the header makes it a record that reaches over chunks; in its place, a
    damaged description of no channel."""
    found = reading(GOOD[:8] + bytes([opcode]) + GOOD[8 if how == "insert" else 9 :])
    assert numbers(found) == without()
    assert set(found.frames) == set(TOPICS)


def test_records_of_unknown_kind_are_searched_once(reading, monkeypatch):
    """Each from where the one before it ended: a file of them must not take its size squared."""
    header, first, *others = parts()
    looked, plain = [], scan.beginnings.read_at

    def noted(stream, offset, length):
        looked.append(plain(stream, offset, length))
        return looked[-1]

    monkeypatch.setattr(scan.beginnings, "read_at", noted)
    data = file([header, first, *[(0x90, bytes(20))] * 500, *others])
    assert numbers(reading(data)) == without()
    passes, overlaps = 2, 2 * 500 * scan.beginnings.OVERLAP  # for descriptions, and for messages
    assert 500 * 29 <= sum(map(len, looked)) <= passes * len(data) + overlaps


def test_a_chunk_in_a_record_of_unknown_kind_is_read_and_a_newer_writers_record_passed(reading):
    """Behind a cut, the last letter of "zstd" is an opcode, and what follows the length of the
    chunk's data: a record that ends where the chunk does."""
    at = CHUNK_AT[1][0]
    unknown = changed(GOOD, at, b"d")
    found = reading(changed(unknown, at + 100, bytes([GOOD[at + 100] ^ 1])))
    assert numbers(found) == without(1)
    assert numbers(reading(unknown, "unknown.mcap")) == without()  # it is still a chunk
    cut = reading(GOOD[:472] + GOOD[472 + 123 :], "cut.mcap")
    assert numbers(cut) == without()
    assert {f.kind for f in cut.health.findings} == {"crc"}
    again = reading(GOOD[:2255] + GOOD[2255 + 281 :], "again.mcap")  # and in a chunk cut short
    assert numbers(again) == without(4)
    header, *others = parts()
    newer = reading(file([header, (0x90, bytes(100)), *others]), "newer.mcap")
    assert numbers(newer) == without() and newer.health.findings == ()


def test_messages_outside_chunks_are_searched_for_behind_damage(reading):
    """Those of a known channel, of the time of the others."""
    bodies = [
        mcap.message(k % 3 + 1, k, START + k * SECOND, START + k * SECOND, payload(k))
        for k in range(30)
    ]
    channels = [(mcap.CHANNEL, mcap.channel(n, 0, t, "json")) for n, t in enumerate(TOPICS, 1)]
    data = file([parts()[0], *channels, *((mcap.MESSAGE, body) for body in bodies)])
    at, _ = places(data, mcap.MESSAGE)[10]
    found = reading(changed(data, at + 5, b"\x40"))  # a length that no file has
    assert numbers(found) == [k for k in range(30) if k != 10]
    early = mcap.message(1, 0, START - 10**15, START, payload(0))  # of another time: no message
    data = changed(data, at + 5, b"\x40")
    data = data[:at] + mcap.record(9, early) + data[at:]
    assert numbers(reading(data, "early.mcap")) == [k for k in range(30) if k != 10]


def test_an_integer_of_hundreds_of_digits_is_infinite(reading):
    huge = b'{"x": 1' + b"0" * 400 + b"}"
    bodies = [mcap.message(1, k, START, START, b'{"x": 0.5}') for k in range(3)]
    bodies += [mcap.message(1, k, START, START, sign + huge[6:]) for k, sign in
               ((3, b'{"x": '), (4, b'{"x": -'))]  # fmt: skip
    raw = described(("/a",)) + b"".join(mcap.record(mcap.MESSAGE, body) for body in bodies)
    found = reading(file([parts()[0], (mcap.CHUNK, packed(raw, 0, 1))]))
    assert found.frames["/a"]["x"].to_list() == [0.5, 0.5, 0.5, float("inf"), float("-inf")]


def test_a_log_whose_payloads_are_all_spoilt_is_refused_with_the_reason(reading):
    raw = described(("/a",)) + mcap.record(mcap.MESSAGE, mcap.message(1, 0, START, START, b"{"))
    with pytest.raises(LogUnreadable, match="none can be decoded: their bytes do not fit"):
        reading(file([parts()[0], (mcap.CHUNK, packed(raw, 0, 0))]))


# --- any damage at all


@given(st.data())
@settings(max_examples=150, deadline=None)
def test_damage_costs_what_it_hits_and_no_more(tmp_path_factory, data):
    """A stretch is overwritten, cut out or inserted: every chunk that it leaves whole is read."""
    at = data.draw(st.integers(len(mcap.MAGIC), len(GOOD)))
    length = data.draw(st.integers(1, 400))
    how = data.draw(st.sampled_from(["overwrite", "cut", "insert"]))
    new = random.Random(data.draw(st.integers(0, 999))).randbytes(length)
    if how == "insert":
        damaged, end = GOOD[:at] + new + GOOD[at:], at
    else:
        end = min(at + length, len(GOOD))
        damaged = GOOD[:at] + (new[: end - at] if how == "overwrite" else b"") + GOOD[end:]
    spared = [
        number for number, (begin, size) in enumerate(CHUNK_AT)
        if begin + size <= at or (begin >= end and not begin < at < begin + size)
    ]  # fmt: skip
    path = tmp_path_factory.getbasetemp() / "hypothesis.mcap"
    path.write_bytes(damaged)
    if 0 not in spared:  # with it the descriptions are gone, and there is no summary
        return
    found = read(path)
    assert set(numbers(found)) >= {k for k in without() if k // EACH in spared}
    assert found.health.messages_read <= CHUNKS * EACH
    assert contents(path).topics.keys() == set(TOPICS)


@given(st.binary(max_size=300))
@settings(max_examples=100, deadline=None)
def test_rubbish_behind_the_magic_is_refused_with_a_sentence(tmp_path_factory, rubbish):
    path = tmp_path_factory.getbasetemp() / "rubbish.mcap"
    path.write_bytes(mcap.MAGIC + rubbish)
    with pytest.raises(LogUnreadable, match=r"rubbish\.mcap"):
        read(path)
