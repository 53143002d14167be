"""Clocks that count from the start of an autopilot, and UTC of its GNSS receivers.

    UTC = GPS epoch + week · 604 800 s + time of week - leap seconds,   t_UTC = t_boot + Δ

Δ is the median of UTC - t_boot over every valid fix: one fix alone is off by the time from its
measurement to its record, which is 0.1 to 0.2 s and varies.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shiplog.logs.health.health_report import Finding
from shiplog.logs.health.leap_seconds import GPS_UTC_S
from shiplog.nomenclature.units import SECOND_NS, YEAR_2000_NS

GPS_EPOCH_NS = 315_964_800 * SECOND_NS  # 1980-01-06
WEEK_NS = 604_800 * SECOND_NS
US_NS, MS_NS = 1_000, 1_000_000
NEAR_NS = SECOND_NS  # a fix whose UTC is further from the clock's is not of this time


def utc_of_gps(week: np.ndarray, ms: np.ndarray) -> np.ndarray:
    """UTC [n] ns of GPS week and ms in it, with the leap seconds of its date."""
    gps = GPS_EPOCH_NS + week.astype(np.int64) * WEEK_NS + ms.astype(np.int64) * MS_NS
    seconds = np.array(list(GPS_UTC_S.values()), np.int64)
    begins = np.array([np.datetime64(day, "ns").astype(np.int64) for day in GPS_UTC_S])
    known = np.searchsorted(begins + seconds * SECOND_NS, gps, side="right") - 1
    return gps - seconds[known.clip(0)] * SECOND_NS


@dataclass(frozen=True, slots=True)
class BootClock:
    """ahead_ns: UTC less the time since boot; None where nothing says it."""

    ahead_ns: int | None

    @staticmethod
    def of(utc: np.ndarray, boot_us: np.ndarray) -> BootClock:
        """Of fixes [n]: UTC ns and µs since boot. Times before 2000 are of no receiver."""
        known = utc >= YEAR_2000_NS
        if not known.any():
            return BootClock(None)
        ahead = utc[known] - boot_us[known].astype(np.int64) * US_NS
        return BootClock(int(np.median(ahead - ahead[0])) + int(ahead[0]))

    def utc(self, boot_us: np.ndarray) -> np.ndarray:
        """UTC [n] ns; ns since boot where no UTC is known."""
        return boot_us.astype(np.int64) * US_NS + (self.ahead_ns or 0)

    def measured(self, utc: np.ndarray, boot_us: np.ndarray) -> np.ndarray:
        """When fixes [n] were measured: by their own UTC where it is one, else by this clock."""
        own = self.utc(boot_us)
        return np.where(np.abs(utc - own) <= NEAR_NS, utc, own)

    def findings(self, what: str) -> list[Finding]:
        if self.ahead_ns is not None:
            return []
        sentence = f"{what} has no UTC: its times count from 1970-01-01, when the autopilot began."
        return [Finding("not_available", "log", sentence)]
