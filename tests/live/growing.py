"""A sample log's first minutes, written again as a recorder does that hands over every second."""

from __future__ import annotations

import inspect
import io
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

SAMPLES = Path(__file__).parents[2] / "sample_logs"
SECOND = 1_000_000_000


def written(name: str, first_s: float, last_s: float, chunk: int = 4096) -> bytes:
    """Messages of so many seconds of a sample log, in chunks of so many bytes."""
    out = io.BytesIO()
    writer = Writer(out, chunk_size=chunk, compression=CompressionType.ZSTD)
    writer.start()
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    with (SAMPLES / f"{name}.mcap").open("rb") as stream:
        reader = make_reader(stream)
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        begin = reader.get_summary().statistics.message_start_time
        since, until = (begin + round(s * SECOND) for s in (first_s, last_s))
        known = inspect.signature(reader.iter_messages).parameters
        names = ("starting_at", "ending_before")  # of mcap 1.4; earlier ones have others
        names = names if names[0] in known else ("start_time", "end_time")
        between = dict(zip(names, (since, until), strict=True))
        for schema, channel, message in reader.iter_messages(**between):
            if channel.id not in channels:
                if schema.id not in schemas:
                    schemas[schema.id] = writer.register_schema(
                        schema.name, schema.encoding, schema.data
                    )
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[schema.id], channel.metadata
                )
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time
            )
    writer.finish()
    return out.getvalue()
