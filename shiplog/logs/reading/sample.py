"""The fields of every topic, from schemas where they say and from a few messages where not."""

from __future__ import annotations

from collections.abc import Iterable

import polars as pl

from shiplog.logs.decoding.json_text import Json
from shiplog.logs.decoding.messages import Decoder
from shiplog.logs.decoding.tables import Tables
from shiplog.logs.mcap_file.container import Survey
from shiplog.logs.reading import salvage

SAMPLE_MESSAGES = 200  # messages of a topic that are decoded


def sample(found: Survey, topics: Iterable[str] | None) -> dict[str, dict[str, pl.DataType]]:
    """Leaf fields by topic; JSON inside a text adds `leaf.field`. Undecodable topics are absent."""
    tables = Tables(found, None if topics is None else dict.fromkeys(topics, ()))
    stated = found.statistics.channel_message_counts if found.statistics else {}
    missing = {number: min(count, SAMPLE_MESSAGES) for number, count in stated.items() if count}
    met: dict[int, list[bytes]] = {}
    for chunk in salvage.messages(found):
        for message in chunk:
            payloads = met.setdefault(message.channel_id, [])
            if len(payloads) < SAMPLE_MESSAGES:
                payloads.append(message.data)
        if missing and all(number in met for number in missing):
            break
    fields: dict[str, dict[str, pl.DataType]] = {}
    for number, channel in found.channels.items():
        reader = tables.decoder(channel)
        if reader is not None:
            into = fields.setdefault(channel.topic, {})
            into.update(reader.layout)
            if met.get(number):
                into.update(_types_of(reader, met[number]))
    return fields


def _types_of(reader: Decoder, payloads: list[bytes]) -> dict[str, pl.DataType]:
    """What only the messages know: the fields of JSON, alone or inside a text."""
    texts = [n for n, t in reader.layout.items() if t in (pl.String, pl.Binary)]
    if reader.layout and not texts:
        return {}
    frame, _ = reader.columns(payloads, texts if reader.layout else None)
    found = dict(frame.schema)
    for name, dtype in frame.schema.items():
        if dtype not in (pl.String, pl.Binary):
            continue
        inside = [v if isinstance(v, bytes) else v.encode() for v in frame[name].drop_nulls()]
        inside = [v for v in inside if v.lstrip()[:1] == b"{"]
        if inside:
            nested, _ = Json(None).columns(inside, None)
            found.update({f"{name}.{inner}": kind for inner, kind in nested.schema.items()})
    return found
