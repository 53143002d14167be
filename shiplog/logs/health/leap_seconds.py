"""Time scales that differ by whole seconds: UTC, the time of GPS, and TAI.

GPS time has no leap seconds: it is ahead of UTC by those since 1980. TAI is 19 s ahead of GPS time.
"""

from __future__ import annotations

import numpy as np

from shiplog.nomenclature.units import SECOND_NS

TAI_GPS_S = 19.0
EXACT_S = 0.3  # a difference that is so near to a known one is that one; latency stays below it
# From when on GPS time was so many seconds ahead of UTC (IERS Bulletin C; none since 2017).
GPS_UTC_S = {
    "1999-01-01": 13, "2006-01-01": 14, "2009-01-01": 15, "2012-07-01": 16, "2015-07-01": 17,
    "2017-01-01": 18,
}  # fmt: skip


def gps_utc_s(instant: float) -> float:
    """By how many seconds GPS time is ahead of UTC at a time [ns since 1970]; 13 before 2006."""
    known = next(iter(GPS_UTC_S.values()))
    for day, seconds in GPS_UTC_S.items():
        if instant >= float(np.datetime64(day, "ns").astype(np.int64)):
            known = seconds
    return float(known)


def known_difference(seconds: float, instant: float) -> tuple[float, str]:
    """The difference of two time scales [s] that a difference of two clocks is, with its sign, and
    which it is; (0, "") where it is none.

    instant  ns since 1970, when it was
    """
    gps = gps_utc_s(instant)
    scales = {
        gps: "GPS time is ahead of UTC", gps + TAI_GPS_S: "TAI is ahead of UTC",
        TAI_GPS_S: "TAI is ahead of GPS time",
    }  # fmt: skip
    for size, name in scales.items():
        if abs(abs(seconds) - size) <= EXACT_S:
            return size if seconds > 0 else -size, f"{size:g} s is what {name}"
    return 0.0, ""


def of_ns(seconds: float) -> int:
    """Seconds as whole nanoseconds."""
    return round(seconds * SECOND_NS)
