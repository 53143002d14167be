#!/usr/bin/env bash
# pynmeagps 1.1.8: utc2wnotow takes the week number from UTC, but the time of week from GPS time. In
# the last 18 s of each Saturday, when the GPS week has begun already, it says the old week and a time
# of week beyond its end. wnotow2utc, its inverse, then goes back to a time a week earlier. A guess
# would be week 2422 and 8 s. BeiDou's weeks, which begin 4 s before UTC's, have the same slip.
#
# Seen: "23:59:41: week 2421, 604799 s, back 0 days off; 23:59:50: week 2421, 604808 s, back -7 days
# off; BeiDou 23:59:58: week 1065, 604802 s, back -7 days off".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'pynmeagps==1.1.8'
"$work/venv/bin/python" - <<'P'
from datetime import datetime, timezone

from pynmeagps.nmeahelpers import utc2wnotow, wnotow2utc


def trip(second: int, gnss: str) -> tuple[int, int, float]:
    """Week, ms of the week, and days between a second of Saturday's last minute and its trip."""
    instant = datetime(2026, 6, 6, 23, 59, second, tzinfo=timezone.utc)
    week, ms, _ = utc2wnotow(instant, gnss, modwno=False)
    back = wnotow2utc(week, ms, gnss=gnss, modwno=False)
    return week, ms // 1000, (back - instant).total_seconds() / 86400.0


before, after, beidou = trip(41, "G"), trip(50, "G"), trip(58, "C")
told = [f"week {week}, {second} s, back {days:.0f} days off" for week, second, days in
        (before, after, beidou)]
print(f"23:59:41: {told[0]}; 23:59:50: {told[1]}; BeiDou 23:59:58: {told[2]}")
assert before == (2421, 604799, 0.0), before
assert after == (2421, 604808, -7.0), f"this has changed: {after}"
assert beidou == (1065, 604802, -7.0), f"this has changed: {beidou}"
P
