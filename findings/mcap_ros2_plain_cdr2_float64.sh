#!/usr/bin/env bash
# mcap-ros2-support 0.6.0 reads a message in PLAIN_CDR2 (XTypes 1.3, 7.6.3.1) as if it were
# PLAIN_CDR: a float64 after an int32 is looked for at byte 8, where CDR2 has it at byte 4. The value
# is wrong and nothing is said; a guess would be an error that names the encapsulation 0x0007.
#
# Seen: "2.5 is read as 5.3e-315".
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


def read(payload: bytes) -> float:
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start(profile="ros2")
    schema = writer.register_schema("test_msgs/msg/Pair", "ros2msg", b"int32 n\nfloat64 x\n")
    channel = writer.register_channel("/pair", "cdr", schema)
    writer.add_message(channel, log_time=1, publish_time=1, data=payload)
    writer.finish()
    stream.seek(0)
    reader = make_reader(stream, decoder_factories=[DecoderFactory()])
    (found,) = reader.iter_decoded_messages()
    return found.decoded_message.x


plain = b"\x00\x01\x00\x00" + struct.pack("<i4xd", 1, 2.5)  # CDR: a float64 on a multiple of 8
plain2 = b"\x00\x07\x00\x00" + struct.pack("<id", 1, 2.5) + bytes(4)  # CDR2: of 4
assert read(plain) == 2.5, read(plain)
wrong = read(plain2)
print(f"2.5 is read as {wrong:.2g}")
assert 0.0 < wrong < 1e-300, f"this has changed: {wrong}"
P
