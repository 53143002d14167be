#!/usr/bin/env bash
# rosbags 0.11.9 and mcap-ros2-support 0.6.0 disagree on both of ROS 2's one-byte names: of a message
# with a `byte` and a `char` that are 0xff each, one reads -1 and 255 and the other 255 and -1. In
# ROS 2 both are unsigned (rosidl makes an octet and a uint8 of them), so each package is right once.
# A guess would be 255 and 255, as the MCAP reader of rerun-sdk 0.41.0 has it.
#
# Seen: "byte and char of 0xff: rosbags -1 and 255, mcap-ros2-support 255 and -1".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'rosbags==0.11.9' 'mcap-ros2-support==0.6.0' 'mcap==1.6.0'
cd "$work"
"$work/venv/bin/python" - <<'P'
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

path = Path("log.mcap")
with path.open("wb") as stream:
    writer = Writer(stream)
    writer.start(profile="ros2")
    definition = b"byte b\nchar c\nuint8 u\nint8 i\n"
    schema = writer.register_schema("test_msgs/msg/Bytes", "ros2msg", definition)
    channel = writer.register_channel("/bytes", "cdr", schema)
    writer.add_message(channel, log_time=1, publish_time=1, data=b"\x00\x01\x00\x00" + b"\xff" * 4)
    writer.finish()

with AnyReader([path]) as bag:
    (one,) = [bag.deserialize(raw, c.msgtype) for c, _, raw in bag.messages()]
with path.open("rb") as stream:
    (found,) = make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
    two = found.decoded_message
assert (one.u, one.i) == (two.u, two.i) == (255, -1), (one, two)
print(
    f"byte and char of 0xff: rosbags {one.b} and {one.c}, mcap-ros2-support {two.b} and {two.c}"
)
assert ((one.b, one.c), (two.b, two.c)) == ((-1, 255), (255, -1)), "this has changed"
P
