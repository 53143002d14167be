"""The other end of `rerun_route`: Rerun's MCAP reader in a process of its own, one line a log.

Rerun ends its whole process on some payloads and never returns from some damage, so nothing else
lives here. A request is a line of JSON on stdin: the log, an empty folder, seconds and bytes of
memory to take, and the wanted fields of each topic. The answer is a line of JSON on stdout: the
rows of each topic, whose columns then stand in the folder as `<number>.arrow`. The end of stdin
ends the process.
"""

from __future__ import annotations

import contextlib
import faulthandler
import json
import os
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
from rerun.chunk import McapReader

sys.path.append(str(Path(__file__).parents[3]))  # last: as the script that started it finds shiplog

from shiplog.machine import child, limits

DECODERS = ["protobuf", "ros2_reflection"]  # the lossless ones: the others reshape what they know
RECORDER_TIMES = ("log_time", "publish_time")


def entity(topic: str) -> str:
    """Rerun's name of a topic, without its escapes: topics may share one."""
    return "/" + "/".join(part for part in topic.replace("\\", "").split("/") if part)


def extract(path: str, folder: Path, topics: Mapping[str, Sequence[str]]) -> list[int]:
    """Write the fields of each topic as an Arrow file; how many rows each has, in their order.

    0 is also a topic that Rerun leaves as bytes, or gives in a shape that is not one row a message.
    """
    numbers = {entity(topic): number for number, topic in enumerate(topics)}
    fields = list(topics.values())
    rows = [0] * len(fields)
    writers: dict[int, pa.RecordBatchFileWriter] = {}
    exactly = [f"^{re.escape(topic)}$" for topic in topics]
    with contextlib.ExitStack() as files:
        for chunk in McapReader(path, decoders=DECODERS, include_topic_regex=exactly).stream():
            number = numbers.get(entity(chunk.entity_path))
            if number is None or chunk.is_static:
                continue
            batch = columns(chunk.to_record_batch(), fields[number])
            if batch is None:
                continue
            if number not in writers:
                target = str(folder / f"{number}.arrow")
                writers[number] = files.enter_context(pa.ipc.new_file(target, batch.schema))
            writers[number].write_batch(batch)
            rows[number] += batch.num_rows
    return rows


def columns(batch: pa.RecordBatch, fields: Sequence[str]) -> pa.RecordBatch | None:
    """The two times and the wanted fields, one row a message."""
    found = [n for n in batch.schema.names if n.endswith(":message")]
    if len(found) != 1:
        return None
    messages = batch.column(found[0]).flatten()
    if len(messages) != batch.num_rows or messages.null_count:
        return None
    made = {f":{name}": batch.column(f"message_{name}").cast(pa.int64()) for name in RECORDER_TIMES}
    for field in fields:
        made[field] = pc.struct_field(messages, field.split("."))  # type: ignore[attr-defined]
    return pa.RecordBatch.from_pydict(made)


def main() -> None:
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # whatever else prints must not stand between the answers
    for line in child.requests():
        asked = json.loads(line)
        faulthandler.dump_traceback_later(asked["seconds"], exit=True)  # also when nobody waits
        limits.set_limits(limits.reserved() + asked["bytes"])  # Rerun itself has 2 GB on two cores
        try:
            reply = {"rows": extract(asked["log"], Path(asked["folder"]), asked["topics"])}
        except Exception as error:
            reply = {"error": f"{type(error).__name__}: {error}"}
        faulthandler.cancel_dump_traceback_later()
        answers.write(json.dumps(reply) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
