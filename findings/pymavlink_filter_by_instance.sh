#!/usr/bin/env bash
# pymavlink 2.4.50: of an ArduPilot log with two receivers, recv_match(type="GPS") gives the messages of
# both, one after the other, and recv_match(type="GPS[1]") none: it reads the whole log and returns None,
# as at its end. Yet "GPS[1]" is the name under which the same reader keeps the last message of that
# receiver in `messages`, and by which a condition reads it. A guess would be that a filter takes the
# names by which messages are kept, or refuses one that it does not know.
#
# Seen: "type='GPS': instances 0, 1, 0, 1, 0, 1; type='GPS[1]': none of 3; messages has GPS[1]: True".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'pymavlink==2.4.50'
cd "$work"
"$work/venv/bin/python" - <<'P'
import struct
from pathlib import Path

from pymavlink import mavutil

HEAD = b"\xa3\x95"
KINDS = {  # number, letters, struct, labels
    "FMT": (128, "BBnNZ", "<BB4s16s64s", "Type,Length,Name,Format,Columns"),
    "FMTU": (129, "QBNN", "<QB16s16s", "TimeUS,FmtType,UnitIds,MultIds"),
    "GPS": (130, "QBBIHBcLLe", "<QBBIHBhiii", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt"),
}


def record(name: str, *values) -> bytes:
    number, _, layout, _ = KINDS[name]
    return HEAD + bytes([number]) + struct.pack(layout, *values)


log = b"".join(
    record("FMT", number, 3 + struct.calcsize(layout), name.encode(), letters.encode(),
           labels.encode())
    for name, (number, letters, layout, labels) in KINDS.items()
)
log += record("FMTU", 1, 130, b"s#-s-S-DUm", b"F--C-0BGGB")  # `#`: I tells instruments apart
for i in range(3):
    for receiver in (0, 1):
        log += record("GPS", 200_000 * i, receiver, 3, 312_816_600 + 200 * i, 2200, 9, 65,
                      599_000_000, 107_000_000, 500)
Path("voyage.bin").write_bytes(log)


def instances(kind: str) -> tuple[list[int], bool]:
    reader = mavutil.mavlink_connection("voyage.bin")
    found = []
    while (message := reader.recv_match(type=kind)) is not None:
        found.append(message.I)
    return found, "GPS[1]" in reader.messages


both, _ = instances("GPS")
one, kept = instances("GPS[1]")
print(
    f"type='GPS': instances {', '.join(map(str, both))}; type='GPS[1]': "
    f"{'none' if not one else one} of {both.count(1)}; messages has GPS[1]: {kept}"
)
assert both == [0, 1] * 3 and kept, "this has changed"
assert one == [], f"this has changed: {one}"
P
