#!/usr/bin/env bash
# pymavlink 2.4.50: DFReader takes 18 s off the GPS time of each ArduPilot log, whatever its date. GPS
# was 16 s ahead of UTC until July 2015 and 17 s until 2017, so that all messages of older logs have
# stamps 2 s or 1 s early. A voyage of those years is then off against any other record in UTC. A guess
# would be the leap seconds of the log's own date, as its GPS message has week and time of week.
#
# Seen: "noon UTC of 2014-06-01 is 11:59:58, of 2015-12-27 11:59:59, of 2026-05-31 12:00:00".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'pymavlink==2.4.50'
cd "$work"
"$work/venv/bin/python" - <<'P'
from datetime import datetime, timedelta, timezone
from pathlib import Path

from pymavlink.DFReader import DFReader_text

LOG = """FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns
FMT, 130, 45, GPS, QBIHBcLLe, TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt
GPS, 1200000, 3, {ms}, {week}, 10, 0.9, 59.9, 10.7, 5.0
"""
GPS_EPOCH = datetime(1980, 1, 6, tzinfo=timezone.utc)


def read(noon: datetime, leap: int) -> str:
    """The time of day that a log's fix at noon, UTC, is read with."""
    since = noon - GPS_EPOCH + timedelta(seconds=leap)
    week, rest = divmod(since, timedelta(weeks=1))
    Path("voyage.log").write_text(LOG.format(week=week, ms=rest // timedelta(milliseconds=1)))
    fix = DFReader_text("voyage.log").recv_match(type="GPS")
    assert (fix.GWk, fix.Lat) == (week, 59.9), fix
    return str(datetime.fromtimestamp(round(fix._timestamp, 3), timezone.utc).time())


days = [((2014, 6, 1), 16), ((2015, 12, 27), 17), ((2026, 5, 31), 18)]
found = [read(datetime(*day, 12, tzinfo=timezone.utc), leap) for day, leap in days]
print(
    f"noon UTC of 2014-06-01 is {found[0]}, of 2015-12-27 {found[1]}, of 2026-05-31 {found[2]}"
)
assert found[2] == "12:00:00", found
assert found[:2] == ["11:59:58", "11:59:59"], f"this has changed: {found}"
P
