#!/usr/bin/env bash
# rerun-sdk 0.41.0: TimeColumn makes other times of a NumPy array than of a list with the same values.
# Seconds are rounded to the nanosecond in a list, as set_time does, and cut off in an array: 2 % of
# the instants of a 10 Hz log are 1 ns early. Datetimes of a list, and of set_time, go through a float
# of seconds and miss by up to 128 ns; those of an array (datetime64) are exact. What was logged at one
# instant in both ways is at two instants, and a query at either finds one of the two.
#
# Seen: "10 Hz for 10000 s: 2415 of 100000 times differ by 1 ns, all early in the array; 1 us after
# 2026-01-01: list 1024 ns, array 1000 ns".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'rerun-sdk==0.41.0' 'numpy==2.4.6'
cd "$work"
"$work/venv/bin/python" - <<'P'
from datetime import datetime, timezone

import numpy as np
import pyarrow as pa
import rerun as rr
from rerun.chunk import RrdReader


def logged(name: str, column: rr.TimeColumn, count: int) -> np.ndarray:
    """The times in ns, in order, as the recording has them."""
    with rr.RecordingStream("test", recording_id=name) as recording:
        recording.save(name)
        recording.send_columns("x", [column], rr.Scalars.columns(scalars=np.zeros(count)))
    chunks = [c for c in RrdReader(name).stream().to_chunks() if c.entity_path == "/x"]
    times = [c.to_record_batch().column("t").cast(pa.int64()).to_numpy() for c in chunks]
    return np.sort(np.concatenate(times))


seconds = np.round(np.arange(100_000) * 0.1, 1)
exact = np.arange(100_000) * 100_000_000
as_list = logged("a.rrd", rr.TimeColumn("t", duration=seconds.tolist()), len(seconds))
as_array = logged("b.rrd", rr.TimeColumn("t", duration=seconds), len(seconds))
assert (as_list == exact).all()
early = exact - as_array

year = np.datetime64("2026-01-01", "ns").astype(np.int64)
instant = datetime(2026, 1, 1, microsecond=1, tzinfo=timezone.utc)
array = np.array(["2026-01-01T00:00:00.000001"], "datetime64[us]")
(of_list,) = logged("c.rrd", rr.TimeColumn("t", timestamp=[instant]), 1) - year
(of_array,) = logged("d.rrd", rr.TimeColumn("t", timestamp=array), 1) - year
print(
    f"10 Hz for 10000 s: {np.count_nonzero(early)} of {len(early)} times differ by {early.max()} ns, "
    f"all early in the array; 1 us after 2026-01-01: list {of_list} ns, array {of_array} ns"
)
assert set(early.tolist()) == {0, 1}, "this has changed"
assert np.count_nonzero(early) == 2415, f"this has changed: {np.count_nonzero(early)}"
assert (of_list, of_array) == (1024, 1000), f"this has changed: {of_list}, {of_array}"
P
