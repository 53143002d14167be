"""The messages of what is sound in a log, and the descriptions of channels on the way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

from mcap.records import McapRecord, Message

from shiplog.logs.mcap_file import chunks, records
from shiplog.logs.mcap_file.container import (
    BROKEN,
    LOOSE,
    SECTION,
    VOUCHED,
    Alone,
    Sound,
    Survey,
    lost,
    note,
)


def messages_of(
    found: Survey, item: Sound | Alone, counts: Counter[int] | None = None
) -> Iterator[list[Message]]:
    """The messages of an item, in batches; its descriptions are noted in `found`.

    counts  messages by channel so far: they are then counted here, and not handed on
    """
    here: Counter[int] | None = None if counts is None else Counter()
    try:
        if isinstance(item, Alone):
            yield _noted(found, chunks.alone(item, here), LOOSE, item.section)
        else:
            belief = VOUCHED if item.chunk.uncompressed_crc else LOOSE
            for batch in chunks.contents(item.chunk, here):
                yield _noted(found, batch, belief, item.section)
    except ValueError as error:  # only where nothing had a checksum
        if isinstance(item, Sound):
            found.losses.append(lost(item.offset, str(error), item.chunk))
    else:
        if counts is not None and here:
            counts.update({n + item.section * SECTION: count for n, count in here.items()})


def _noted(found: Survey, batch: Iterable[McapRecord], belief: int, section: int) -> list[Message]:
    here = []
    for record in batch:
        if isinstance(record, Message):
            record.channel_id += section * SECTION
            here.append(record)
        else:
            whole = not isinstance(record, records.Unnamed)
            note(found, record, belief if whole else BROKEN, section)
    return here
