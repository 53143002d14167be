#!/usr/bin/env bash
# rosbags 0.11.9: one topic whose schema is ros2idl with an `#include` line, as the IDL of a message
# that uses another one has it, and AnyReader opens no topic of the file at all, the others neither.
# Without that line the same file is read.
#
# Seen: "with the line: AnyReaderError; without it: 1 message of 2.5".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'rosbags==0.11.9' 'mcap==1.6.0'
cd "$work"
"$work/venv/bin/python" - <<'P'
import struct
from pathlib import Path

from mcap.writer import Writer
from rosbags.highlevel import AnyReader, AnyReaderError

BAR = "=" * 80 + "\n"
TIME = (
    BAR + "IDL: builtin_interfaces/msg/Time\n"
    "module builtin_interfaces { module msg { struct Time { long sec; unsigned long nanosec; }; }; };\n"
)
POINT = (
    BAR + "IDL: test_msgs/msg/Point\n{line}"
    "module test_msgs {{ module msg {{ struct Point {{ builtin_interfaces::msg::Time stamp; "
    "double x; }}; }}; }};\n"
)


def made(name: str, line: str) -> Path:
    path = Path(name)
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        text = (POINT.format(line=line) + TIME).encode()
        schema = writer.register_schema("test_msgs/msg/Point", "ros2idl", text)
        channel = writer.register_channel("/point", "cdr", schema)
        payload = b"\x00\x01\x00\x00" + struct.pack("<iId", 1, 0, 2.5)
        writer.add_message(channel, log_time=1, publish_time=1, data=payload)
        writer.finish()
    return path


def read(path: Path) -> str:
    try:
        with AnyReader([path]) as reader:
            found = [reader.deserialize(raw, c.msgtype).x for c, _, raw in reader.messages()]
    except AnyReaderError:
        return "AnyReaderError"
    return f"{len(found)} message of {found[0]}"


with_line = read(made("with.mcap", '#include "builtin_interfaces/msg/Time.idl"\n'))
without = read(made("without.mcap", ""))
print(f"with the line: {with_line}; without it: {without}")
assert (with_line, without) == ("AnyReaderError", "1 message of 2.5"), "this has changed"
P
