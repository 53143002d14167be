"""When messages on an NMEA 2000 bus were sent, in UTC.

The stamps of a log are its recorder's: Unix time, a time of day without a date, a counter, or none.
UTC is in 126992, 129029 and 129033. The difference of the two is taken as the median over the
sender whose messages scatter least, so that every stamp is in UTC, with a date.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shiplog.logs.conversion.nmea2000_fields import NAMES, read_field
from shiplog.logs.conversion.nmea2000_lines import LEAST_UNIX_S, Bus
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.units import SECOND_NS, YEAR_2000_NS, YEAR_2100_NS

DAY_NS = 86_400 * SECOND_NS
CLOCKS = (126992, 129029, 129033)  # that have date and time, the most trusted first
NEAR_NS = 5 * SECOND_NS  # a fix whose UTC is further from the bus's is not of this time
LATE_NS = SECOND_NS // 2  # a recorder's clock that is off by more is reported


@dataclass
class BusClock:
    """Times of the rows of a log.

    places, stamps  of every row, in the order of the lines; stamps without their wraps
    ahead_ns        UTC less stamp; None where nothing says UTC
    """

    places: np.ndarray
    stamps: np.ndarray
    ahead_ns: int | None
    findings: list[Finding]

    def times(self, place: np.ndarray) -> np.ndarray:
        """UTC [n] ns of rows at these lines."""
        at = np.searchsorted(self.places, place)
        return self.stamps[at] + (self.ahead_ns or 0)


def utc_of(pgn: int, payload: np.ndarray) -> np.ndarray:
    """UTC [n] ns that messages state; -1 where they state none."""
    day, second = (read_field(pgn, name, payload) for name in ("date", "time"))
    stated = np.isfinite(day) & np.isfinite(second)
    utc = np.where(stated, np.nan_to_num(day), 0).astype(np.int64) * DAY_NS
    utc += np.rint(np.where(stated, np.nan_to_num(second), 0.0) * 1e4).astype(np.int64) * 100_000
    return np.where(stated & (utc >= YEAR_2000_NS) & (utc < YEAR_2100_NS), utc, -1)


def clock_of(bus: Bus, name: str) -> BusClock:
    """The clock of a log, and what there is to say of it."""
    rows = {key: one.arrays() for key, one in bus.rows.items()}
    places = np.concatenate([place for place, _, _ in rows.values()])
    stamps = np.concatenate([stamp for _, stamp, _ in rows.values()])
    order = np.argsort(places, kind="stable")
    places, stamps = places[order], stamps[order]
    stated = [
        (pgn, place[known], utc[known]) for (pgn, _), (place, _, payload) in rows.items()
        if pgn in CLOCKS and (known := (utc := utc_of(pgn, payload)) >= 0).any()
    ]  # fmt: skip
    if (stamps < 0).any():
        return _by_order(places, stated, name)
    if bus.notation.wraps_ns:
        back = np.diff(stamps, prepend=stamps[:1]) < -bus.notation.wraps_ns // 2
        stamps = stamps + np.cumsum(back) * bus.notation.wraps_ns
    best = None
    for pgn, place, utc in stated:
        ahead = utc - stamps[np.searchsorted(places, place)]
        middle = int(np.median(ahead - ahead[0])) + int(ahead[0])
        spread = float(np.median(np.abs(ahead - middle)))
        if best is None or spread < best[0]:
            best = spread, middle, pgn
    dated = stamps[0] >= LEAST_UNIX_S * SECOND_NS
    if best is None:
        findings = [] if dated else [_dateless(name)]
        return BusClock(places, stamps, None, findings)
    _, ahead_ns, pgn = best
    findings = []
    if dated and abs(ahead_ns) > LATE_NS:
        side = "behind" if ahead_ns > 0 else "ahead of"
        sentence = (
            f"The recorder's clock is {abs(ahead_ns) / SECOND_NS:.1f} s {side} UTC of PGN {pgn} "
            f"({NAMES[pgn]}); it was put right."
        )
        value = -ahead_ns / SECOND_NS
        findings = [Finding("clock_offset", "log", sentence, value=value, unit="s")]
    return BusClock(places, stamps, ahead_ns, findings)


def _by_order(
    places: np.ndarray, stated: list[tuple[int, np.ndarray, np.ndarray]], name: str
) -> BusClock:
    """Of lines without stamps: between the messages that have UTC, by their places."""
    if not stated:
        return BusClock(places, places * 1_000_000, None, [_dateless(name)])
    _, place, utc = max(stated, key=lambda one: len(one[1]))
    rising = np.concatenate(([True], np.diff(np.maximum.accumulate(utc)) > 0))
    place, utc = place[rising], utc[rising]
    if len(place) < 2:
        return BusClock(places, places * 1_000_000, None, [_dateless(name)])
    since = (utc - utc[0]).astype(float)
    slope = (since[-1] - since[0]) / max(1, int(place[-1] - place[0]))
    inside = np.interp(places.astype(float), place.astype(float), since)
    before, after = places < place[0], places > place[-1]
    inside = np.where(before, (places - place[0]) * slope, inside)
    inside = np.where(after, since[-1] + (places - place[-1]) * slope, inside)
    sentence = (
        f"The lines of {name} have no stamps: their times are laid between the messages that state "
        "UTC, and are good to the time between two of these."
    )
    found = [Finding("not_available", "log", sentence)]
    return BusClock(places, np.rint(inside).astype(np.int64) + int(utc[0]), 0, found)


def _dateless(name: str) -> Finding:
    sentence = (
        f"{name} has no date: neither its lines nor a PGN 126992, 129029 or 129033 say one. Its "
        "times count from 1970-01-01."
    )
    return Finding("not_available", "log", sentence)
