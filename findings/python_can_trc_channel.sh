#!/usr/bin/env bash
# python-can 4.6.1: a CAN log in PEAK's TRC format (2.1, which the package writes) has its messages one
# channel higher each time that it is read and written again. The writer adds one to a channel, as TRC
# counts from 1, but the reader does not take it off. Logs in ASC and BLF, which count from 1 too, keep
# their channels. A guess would be that TRC does, so that ASC to TRC and back changes no channel.
#
# Seen: "channels 0 and 1 after one, two and three trips: TRC 1 2, 2 3, 3 4; ASC 0 1, 0 1, 0 1;
# BLF 0 1, 0 1, 0 1".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'python-can==4.6.1'
cd "$work"
"$work/venv/bin/python" - <<'P'
import can


def trips(ending: str) -> list[list[int]]:
    """The channels of two messages after one, two and three trips through files."""
    messages = [
        can.Message(timestamp=1.7e9 + channel, arbitration_id=0x123, data=[1, 2], channel=channel)
        for channel in (0, 1)
    ]
    found = []
    for trip in range(3):
        name = f"log{trip}{ending}"
        with can.Logger(name) as log:
            for message in messages:
                log(message)
        with can.LogReader(name) as log:
            messages = list(log)
        found.append([message.channel for message in messages])
    return found


kinds = {ending: trips(ending) for ending in (".trc", ".asc", ".blf")}
told = "; ".join(
    f"{ending[1:].upper()} " + ", ".join(f"{first} {second}" for first, second in found)
    for ending, found in kinds.items()
)
print(f"channels 0 and 1 after one, two and three trips: {told}")
assert kinds[".asc"] == kinds[".blf"] == [[0, 1]] * 3, kinds
assert kinds[".trc"] == [[1, 2], [2, 3], [3, 4]], f"this has changed: {kinds}"
P
