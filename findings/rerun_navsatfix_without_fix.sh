#!/usr/bin/env bash
# rerun-sdk 0.41.0: its MCAP reader makes a point on the map of a sensor_msgs/NavSatFix whose status
# says that there is no fix (-1), and hands on neither the status nor the covariance, so that a query
# cannot tell it from a fix. What a receiver writes as position then means nothing, often its last one
# or zero. A guess would be no point, or the status beside it.
#
# Seen: "points: 59.0 10.0 with a fix, 0.0 0.0 without; other columns: altitude, frame".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'rerun-sdk==0.41.0' 'mcap==1.6.0'
cd "$work"
"$work/venv/bin/python" - <<'P'
import struct

from mcap.writer import Writer
from rerun.chunk import McapReader

BAR = "=" * 80 + "\n"
FIX = (
    "std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\nfloat64 longitude\n"
    "float64 altitude\nfloat64[9] position_covariance\nuint8 position_covariance_type\n"
    + BAR + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    + BAR + "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    + BAR + "MSG: sensor_msgs/NavSatStatus\nint8 status\nuint16 service\n"
)


def message(status: int, latitude: float, longitude: float) -> bytes:
    body = struct.pack("<iII4sbxH", 10, 0, 4, b"gps\0", status, 1)
    body += bytes(-len(body) % 8)
    numbers = struct.pack("<12dB", latitude, longitude, 0.0, *[0.0] * 9, 0)
    return b"\x00\x01\x00\x00" + body + numbers


with open("log.mcap", "wb") as stream:
    writer = Writer(stream)
    writer.start(profile="ros2")
    schema = writer.register_schema("sensor_msgs/msg/NavSatFix", "ros2msg", FIX.encode())
    channel = writer.register_channel("/fix", "cdr", schema)
    for time, data in enumerate((message(0, 59.0, 10.0), message(-1, 0.0, 0.0)), start=1):
        writer.add_message(channel, log_time=time, publish_time=time, data=data)
    writer.finish()

points, others = [], set()
for chunk in McapReader("log.mcap").stream().to_chunks():
    batch = chunk.to_record_batch()
    if chunk.entity_path != "/fix" or chunk.is_static:
        continue
    points += [row[0] for row in batch.column("GeoPoints:positions").to_pylist()]
    others |= set(batch.schema.names) - set(chunk.timeline_names)
others = {name.split(":")[-1] for name in others if "RowId" not in name} - {"positions"}
shown = [" ".join(map(str, point)) for point in points]
print(
    f"points: {shown[0]} with a fix, {shown[1]} without; other columns: {', '.join(sorted(others))}"
)
assert points == [[59.0, 10.0], [0.0, 0.0]], f"this has changed: {points}"
assert others == {"altitude", "frame"}, f"this has changed: {others}"
P
