"""NMEA 0183 of a ship whose motion is known, written sentence by sentence, and how far off a topic
is from it. Nothing of it is shiplog's."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from functools import reduce
from operator import xor

import numpy as np

from shiplog.logs.conversion.nmea import NmeaLog, read_nmea_log

START = 1_717_236_000.0  # 2024-06-01 10:00:00 UTC
LATITUDE, LONGITUDE = 54.0, 10.0
SPEED = 2.0  # m/s, steady
METRES = 111_320.0  # a degree of latitude
KNOTS = 3600.0 / 1852.0


def sentence(body: str, mark: str = "$") -> str:
    return f"{mark}{body}*{reduce(xor, body.encode()):02X}"


def heading(t):
    """deg, at seconds t after the start: it swings by 2 deg/s at most."""
    return 40.0 + 60.0 / math.pi * np.sin(np.asarray(t) * math.tau / 60.0)


def rudder(t):
    return 20.0 * np.sin((np.asarray(t) + 3.0) * math.tau / 60.0)


def where(t: float, north: float = 0.0, east: float = 0.0) -> tuple[float, float]:
    """deg, of a ship that goes straight to the north-east; an antenna may be elsewhere [m]."""
    way = SPEED * t / math.sqrt(2.0)
    scale = METRES * math.cos(math.radians(LATITUDE))
    return LATITUDE + (way + north) / METRES, LONGITUDE + (way + east) / scale


def when(t: float, form: str = "%H%M%S.%f") -> str:
    return datetime.fromtimestamp(round(START + t, 6), UTC).strftime(form)


def utc(t: float, digits: int = 2) -> str:
    text = when(t)
    return text[: 7 + digits] if digits else text[:6]


def place(t: float, north: float = 0.0, east: float = 0.0) -> str:
    latitude, longitude = where(t, north, east)
    return (
        f"{int(latitude):02d}{latitude % 1 * 60:010.7f},N,"
        f"{int(longitude):03d}{longitude % 1 * 60:010.7f},E"
    )


def rmc(t, talker="GP", mode="A", date=None, stamp=None, at=None, status="A") -> str:
    date = when(t, "%d%m%y") if date is None else date
    return sentence(
        f"{talker}RMC,{utc(t) if stamp is None else stamp},{status},{at or place(t)},"
        f"{SPEED * KNOTS:.5f},45.0000,{date},,,{mode}"
    )


def gga(t, talker="GP", quality=4, at=None, stamp=None) -> str:
    stamp = utc(t) if stamp is None else stamp
    return sentence(f"{talker}GGA,{stamp},{at or place(t)},{quality},12,0.7,3.0,M,40.0,M,,")


def hdt(t, talker="HE") -> str:
    return sentence(f"{talker}HDT,{heading(t):.4f},T")


def rsa(t) -> str:
    return sentence(f"AGRSA,{rudder(t):.4f},A,,")


def iso(t: float) -> str:
    return when(t, "%Y-%m-%dT%H:%M:%S.%f")[:-3] + "Z"


def read(folder, lines, name="a.log") -> tuple[dict, NmeaLog]:
    """The topics by name, and all that was said."""
    (folder / name).write_text("\r\n".join(lines) + "\r\n")
    found = read_nmea_log([folder / name], name)
    return {one.topic: one for one in found.series}, found


def seconds(series) -> np.ndarray:
    return (series.time - round(START * 1e9)) * 1e-9


def late(series, truth, field) -> float:
    """The largest error of a topic against the truth at its own times."""
    return float(np.nanmax(np.abs(series.columns[field] - truth(seconds(series)))))


def kinds(found: NmeaLog) -> list[str]:
    return [finding.kind for finding in found.findings]
