"""What each NMEA 0183 sentence says of a ship, in the contract's topics and units."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from shiplog import units

Fact = tuple[str, tuple[float, ...]]  # a key of SENTENCE_TOPICS, and its values
WHERE = ("latitude", "longitude")

# Schema and fields; what begins with a letter stands in for a topic of the contract.
SENTENCE_TOPICS = {
    "gga": ("foxglove.LocationFix", (*WHERE, "altitude")),
    "rmc": ("foxglove.LocationFix", WHERE),
    "gll": ("foxglove.LocationFix", WHERE),
    "rmc_velocity": ("shiplog.GnssVelocity", ("sog_mps", "cog_deg")),
    "vtg": ("shiplog.GnssVelocity", ("sog_mps", "cog_deg")),
    "/gyro": ("shiplog.Gyro", ("heading_deg",)),
    "/gyro/rate": ("shiplog.Gyro", ("yaw_rate_degps",)),
    "/wind/apparent": ("shiplog.Wind", ("speed_mps", "direction_deg")),
    "/wind/true": ("shiplog.Wind", ("speed_mps", "direction_deg")),
    "/rudder": ("shiplog.Rudder", ("angle_deg",)),
    "/propeller": ("shiplog.Propeller", ("speed_rps",)),
}
INSTEAD = {  # the contract's topic, and which sentence is taken for it, the best first
    "/gnss/fix": ("gga", "rmc", "gll"),
    "/gnss/velocity": ("rmc_velocity", "vtg"),
}
WIND_UNITS = {"N": "kn", "M": "m/s", "K": "km/h", "S": "mph"}


class NotValid(Exception):
    """The sensor itself says, by its status, that this is no measurement."""


def family(topic: str) -> str:
    """The key of SENTENCE_TOPICS that a topic such as /rudder/port belongs to."""
    return topic if topic in SENTENCE_TOPICS else "/" + topic.split("/")[1]


def facts(message) -> list[Fact] | None:
    """What a parsed sentence says; None for a kind that is not read here.

    Raises NotValid, and ValueError or TypeError for a field that is no number.
    """
    read = SENTENCES.get(message.sentence_type)
    return None if read is None else list(read(message))


def _number(value) -> float:
    return math.nan if value in (None, "") else float(value)


def _at(message, place: int) -> str:
    """A field by its place: short sentences leave the last ones out."""
    return message.data[place] if place < len(message.data) else ""


def _require(valid: bool) -> None:
    if not valid:
        raise NotValid


def _knots(value) -> float:
    return _number(value) * units.factor("kn")


def _where(m) -> tuple[float, float]:
    """Latitude and longitude [deg]; NaN without a number or its hemisphere, where pynmea2 has 0."""
    if not (m.lat and m.lon and m.lat_dir in ("N", "S") and m.lon_dir in ("E", "W")):
        return math.nan, math.nan
    return m.latitude, m.longitude


def _rmc(m) -> Iterator[Fact]:
    _require(m.status == "A")
    yield "rmc", _where(m)
    yield "rmc_velocity", (_knots(m.spd_over_grnd), _number(m.true_course))


def _gga(m) -> Iterator[Fact]:
    _require(bool(m.gps_qual))
    yield "gga", (*_where(m), _number(m.altitude))


def _gll(m) -> Iterator[Fact]:
    _require(m.status == "A")
    yield "gll", _where(m)


def _vtg(m) -> Iterator[Fact]:
    yield "vtg", (_knots(m.spd_over_grnd_kts), _number(m.true_track))


def _heading(m) -> Iterator[Fact]:
    """HDT has the letter T where THS has its mode, of which V is no measurement."""
    _require(_at(m, 1) != "V")
    yield "/gyro", (_number(_at(m, 0)),)


def _rot(m) -> Iterator[Fact]:
    """Degrees a minute, negative where the bow turns to port."""
    _require(_at(m, 1) != "V")
    yield "/gyro/rate", (_number(_at(m, 0)) / 60.0,)


def _mwv(m) -> Iterator[Fact]:
    """Where the wind blows from, against the bow in both references."""
    _require(_at(m, 4) != "V")
    factor = units.factor(WIND_UNITS.get(_at(m, 3), "m/s"))
    topic = "/wind/true" if _at(m, 1) == "T" else "/wind/apparent"
    yield topic, (_number(_at(m, 2)) * factor, _number(_at(m, 0)))


def _rsa(m) -> Iterator[Fact]:
    """The starboard, or the only, rudder and then port; negative turns the bow to port."""
    starboard, port = ((_at(m, i), _at(m, i + 1) != "V") for i in (0, 2))
    _require(starboard[1] or (port[1] and port[0] != ""))
    for name, (angle, valid) in (("starboard", starboard), ("port", port)):
        if angle and valid:
            yield f"/rudder/{name}", (_number(angle),)


def _rpm(m) -> Iterator[Fact]:
    """Of a shaft or an engine, by its number: 0 is single or on the centre line."""
    _require(_at(m, 4) != "V")
    source = "engine" if _at(m, 0) == "E" else "shaft"
    yield f"/propeller/{source}_{_at(m, 1) or 0}", (_number(_at(m, 2)) * units.factor("rpm"),)


SENTENCES: dict[str, Callable[..., Iterator[Fact]]] = {
    "RMC": _rmc, "GGA": _gga, "GLL": _gll, "VTG": _vtg, "HDT": _heading, "THS": _heading,
    "ROT": _rot, "MWV": _mwv, "RSA": _rsa, "RPM": _rpm,
}  # fmt: skip
