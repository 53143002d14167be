#!/usr/bin/env bash
# mcap-ros2-support 0.6.0: a field of builtin_interfaces/Duration whose definition the schema leaves
# out (bags of older recorders do) is filled in by the package itself, with an unsigned `sec`. The
# message's own definition is int32 sec, uint32 nanosec, so that -0.5 s is (-1, 500000000).
#
# Seen: "-0.5 s is read as 4294967295 s and 500000000 ns".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'mcap-ros2-support==0.6.0' 'mcap==1.6.0'
"$work/venv/bin/python" - <<'P'
import io
import struct

from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory

OWN = b"builtin_interfaces/Duration d\n"
WHOLE = OWN + b"=" * 80 + b"\nMSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n"


def read(definition: bytes) -> tuple[int, int]:
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start(profile="ros2")
    schema = writer.register_schema("test_msgs/msg/Late", "ros2msg", definition)
    channel = writer.register_channel("/late", "cdr", schema)
    payload = b"\x00\x01\x00\x00" + struct.pack("<iI", -1, 500_000_000)
    writer.add_message(channel, log_time=1, publish_time=1, data=payload)
    writer.finish()
    stream.seek(0)
    (found,) = make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
    return found.decoded_message.d.sec, found.decoded_message.d.nanosec


assert read(WHOLE) == (-1, 500_000_000), read(WHOLE)
sec, nanosec = read(OWN)
print(f"-0.5 s is read as {sec} s and {nanosec} ns")
assert (sec, nanosec) == (2**32 - 1, 500_000_000), f"this has changed: {sec}, {nanosec}"
P
