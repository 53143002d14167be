"""Records in bytes that come in pieces, against reading them one behind the other."""

from __future__ import annotations

import struct
from collections import Counter

import mcap_bytes as mcap
from hypothesis import given, settings
from hypothesis import strategies as st

from shiplog.logs.mcap_file import records

# Stretches of records of one kind and length, as many as are looked for at once and more; and what
# stands between them: records of any kind, and of the same length by chance.
STRETCH = st.tuples(
    st.sampled_from([mcap.MESSAGE, mcap.MESSAGE, mcap.CHANNEL, 0x80]),
    st.sampled_from([0, 5, 22, 23, 40]),
    st.sampled_from([1, 2, records.ALIKE, records.ALIKE + 2, 3000]),
)


def written(stretches, seed):
    """The bytes, and each record as (opcode, body); bodies begin with channels that differ."""
    made = []
    for opcode, length, count in stretches:
        for number in range(count):
            body = struct.pack("<HI", (seed + number) % 5 + 300 * (number % 2), number)
            made.append((opcode, (body + bytes(length))[:length]))
    return b"".join(mcap.record(*one) for one in made), made


@given(
    stretches=st.lists(STRETCH, min_size=1, max_size=5), seed=st.integers(0, 9),
    piece=st.integers(9, 200_000),
)  # fmt: skip
@settings(max_examples=25, deadline=None)
def test_records_are_the_same_however_many_are_alike_and_wherever_they_are_cut(
    stretches, seed, piece
):
    data, made = written(stretches, seed)
    pieces = [data[at : at + piece] for at in range(0, len(data), piece)]
    met, counts = [], Counter()
    for part, runs in records.split(pieces, len(data)):
        met += [(opcode, bytes(part[at:to])) for opcode, at, to in records.places(runs)]
        left = records.count_messages(part, runs, counts)
        assert all(opcode != mcap.MESSAGE for opcode, *_ in left)
    assert met == made
    messages = [body for opcode, body in made if opcode == mcap.MESSAGE and len(body) >= 22]
    assert counts == Counter(int.from_bytes(body[:2], "little") for body in messages)
