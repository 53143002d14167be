"""What each NMEA 0183 sentence says of a ship, in the contract's topics and units.

`SENTENCES` is the table: a kind, and the function from its fields to facts. A value counts only
with the letter that follows it (`T`, `N`, `A`): a sentence that is cut ends before that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

from shiplog.logs.conversion import nmea_status as status
from shiplog.nomenclature import units

BLANK = math.nan
WHERE = ("latitude", "longitude")
KNOT = units.factor("kn")
RPM = units.factor("rpm")
WIND_UNITS = {"N": KNOT, "M": 1.0, "K": units.factor("km/h"), "S": units.factor("mph")}
LARGEST_RUDDER_DEG = 180.0

# Schema and fields; what begins with a letter stands in for a topic of the contract.
SENTENCE_TOPICS = {
    "gga": ("foxglove.LocationFix", (*WHERE, "altitude")),
    "gns": ("foxglove.LocationFix", (*WHERE, "altitude")),
    "rmc": ("foxglove.LocationFix", WHERE),
    "gll": ("foxglove.LocationFix", WHERE),
    "vdo": ("foxglove.LocationFix", WHERE),
    "rmc_velocity": ("shiplog.GnssVelocity", ("sog_mps", "cog_deg")),
    "vtg": ("shiplog.GnssVelocity", ("sog_mps", "cog_deg")),
    "vdo_velocity": ("shiplog.GnssVelocity", ("sog_mps", "cog_deg")),
    "hdt": ("shiplog.Gyro", ("heading_deg",)),
    "ths": ("shiplog.Gyro", ("heading_deg",)),
    "hdg": ("shiplog.Gyro", ("heading_deg", "variation_deg", "deviation_deg")),
    "hdm": ("shiplog.Gyro", ("heading_deg", "variation_deg", "deviation_deg")),
    "vhw": ("shiplog.Gyro", ("heading_deg",)),
    "vhw_magnetic": ("shiplog.Gyro", ("heading_deg", "variation_deg", "deviation_deg")),
    "vdo_heading": ("shiplog.Gyro", ("heading_deg",)),
    "mwv_r": ("shiplog.Wind", ("speed_mps", "direction_deg")),
    "vwr": ("shiplog.Wind", ("speed_mps", "direction_deg")),
    "mwv_t": ("shiplog.Wind", ("speed_mps", "direction_deg")),
    "vwt": ("shiplog.Wind", ("speed_mps", "direction_deg")),
    "/gyro/rate": ("shiplog.Gyro", ("yaw_rate_degps",)),
    "/wind/true_north": ("shiplog.Wind", ("speed_mps", "direction_deg")),
    "/speed/water": ("shiplog.WaterSpeed", ("through_water_mps",)),
    "/rudder": ("shiplog.Rudder", ("angle_deg",)),
    "/propeller": ("shiplog.Propeller", ("speed_rps",)),
    "/thruster": ("shiplog.Thruster", ("command",)),  # the pitch of a propeller, -1 to 1
    "variation": ("", ("variation_deg",)),  # of RMC: no topic, but it makes a compass true
}
INSTEAD = {  # the contract's topic, and which sentence is taken for it, the best first
    "/gnss/fix": ("gga", "gns", "rmc", "gll", "vdo"),
    "/gnss/velocity": ("rmc_velocity", "vtg", "vdo_velocity"),
    "/gyro": ("hdt", "ths", "hdg", "hdm", "vhw", "vhw_magnetic", "vdo_heading"),
    "/wind/apparent": ("mwv_r", "vwr"),
    "/wind/true": ("mwv_t", "vwt"),
}
COMPASS = ("hdg", "hdm")  # the next to a gyro are a topic of their own
FIXES = frozenset({"gga", "gns", "rmc", "gll"})
MAGNETIC = frozenset({"hdg", "hdm", "vhw_magnetic"})


class Fact(NamedTuple):
    """What a sentence says of one topic."""

    topic: str  # a key of SENTENCE_TOPICS
    values: tuple[float, ...]
    why_not: str = ""  # the sentence's own word, if it says that this is no measurement


class Cut(ValueError):
    """Fields that belong to the sentence are not there."""


def family(topic: str) -> str:
    """The key of SENTENCE_TOPICS that a topic such as /rudder/port belongs to."""
    return topic if topic in SENTENCE_TOPICS else "/" + topic.split("/")[1]


def number(text: str) -> float:
    """A field's number, NaN of a blank one. Raises ValueError: a damaged number is none."""
    if not text:
        return BLANK
    if text.strip("+-.0123456789"):  # what `float` takes beyond a sentence's digits: nan, 1e5, 1_0
        raise ValueError(text)
    return float(text)


def coordinate(text: str, letter: str, positive: str, negative: str, most: float) -> float:
    """Degrees of `ddmm.mmm` and its hemisphere; NaN without either.

    A minus before a western or southern one repeats the letter. Raises ValueError for what is no
    place, and for a minus that the letter contradicts.
    """
    if not text or not letter:
        return BLANK
    if letter not in (positive, negative):
        raise ValueError(letter)
    minus = text[0] == "-"
    if minus and letter == positive:
        raise ValueError(f"{text},{letter}")
    digits = text[1:] if minus else text
    point = digits.find(".")
    point = len(digits) if point < 0 else point
    minutes = number(digits[max(point - 2, 0) :])
    degrees = number(digits[: max(point - 2, 0)] or "0")
    value = degrees + minutes / 60.0
    if not (0.0 <= minutes < 60.0 and value <= most):
        raise ValueError(text)
    return -value if letter == negative else value


def place(f: list[str], at: int) -> tuple[float, float]:
    """Latitude and longitude [deg] of four fields. Raises ValueError."""
    latitude = coordinate(f[at], f[at + 1], "N", "S", 90.0)
    longitude = coordinate(f[at + 2], f[at + 3], "E", "W", 180.0)
    if math.isnan(latitude) or math.isnan(longitude):
        return BLANK, BLANK
    return latitude, longitude


def angle(text: str) -> float:
    """A direction [deg]. Raises ValueError beyond a full turn."""
    value = number(text)
    if abs(value) > 360.0:
        raise ValueError(text)
    return value


def east_positive(text: str, letter: str) -> float:
    """A variation or deviation [deg], + east; a minus with W is west once. Raises ValueError."""
    value = number(text)
    if math.isnan(value) or letter not in ("E", "W"):
        return BLANK
    return -abs(value) if letter == "W" else value


def _need(f: list[str], count: int, vouched: bool) -> None:
    """Raises Cut for a sentence that has fewer fields, and no checksum to say that it is whole."""
    if len(f) < count and not vouched:
        raise Cut
    f.extend([""] * (count - len(f)))


def _letter(f: list[str], at: int, letters: str, vouched: bool) -> None:
    """Raises Cut where a value is not followed by one of its letters."""
    if f[at - 1] and f[at] not in letters.split() and (f[at] or not vouched):
        raise Cut


def _fix(topic: str, where: tuple[float, ...], why_not: str) -> Fact:
    if where[0] == 0.0 and where[1] == 0.0:
        why_not = why_not or status.NO_FIX
    return Fact(topic, where, why_not)


def _rmc(f: list[str], vouched: bool) -> Iterator[Fact]:
    """Time, status, latitude, longitude, knots, course, date, variation; since 2.3 the mode."""
    _need(f, 9, vouched)
    f.extend([""] * (13 - len(f)))
    why_not = status.status(f[1], f[11])
    if f[1] not in ("A", "V", ""):
        raise Cut
    fix = _fix("rmc", place(f, 2), why_not)
    yield fix
    yield Fact("rmc_velocity", (number(f[6]) * KNOT, angle(f[7])), fix.why_not)
    variation = east_positive(f[9], f[10])
    if not math.isnan(variation) and not fix.why_not:
        yield Fact("variation", (variation,))


def _gga(f: list[str], vouched: bool) -> Iterator[Fact]:
    """Time, latitude, longitude, quality, satellites, dilution, altitude; the rest may be short."""
    _need(f, 10, vouched)
    _letter(f, 9, "M", vouched)
    yield _fix("gga", (*place(f, 1), number(f[8])), status.quality(f[5]))


def _gns(f: list[str], vouched: bool) -> Iterator[Fact]:
    """As GGA, with a letter for each satellite system."""
    _need(f, 10, vouched)
    yield _fix("gns", (*place(f, 1), number(f[8])), status.modes(f[5]))


def _gll(f: list[str], vouched: bool) -> Iterator[Fact]:
    """Latitude, longitude; since 2.0 time and status, since 2.3 the mode."""
    _need(f, 4, vouched)
    f.extend([""] * (7 - len(f)))
    yield _fix("gll", place(f, 0), status.status(f[5], f[6]))


def _vtg(f: list[str], vouched: bool) -> Iterator[Fact]:
    """Course true and magnetic, speed in knots and km/h, each with its letter; since 2.3 the mode.

    Before 2.0 the letters were not there: course, course, knots, km/h."""
    if len(f) == 4 and f[1] not in ("T", ""):
        yield Fact("vtg", (number(f[2]) * KNOT, angle(f[0])))
        return
    _need(f, 8, vouched)
    f.extend([""] * (9 - len(f)))
    _letter(f, 1, "T", vouched)
    _letter(f, 5, "N", vouched)
    speed = number(f[4]) * KNOT if f[4] else number(f[6]) * WIND_UNITS["K"]
    yield Fact("vtg", (speed, angle(f[0])), status.status("", f[8]))


def _hdt(f: list[str], vouched: bool) -> Iterator[Fact]:
    _need(f, 2, vouched)
    _letter(f, 1, "T", vouched)
    yield Fact("hdt", (angle(f[0]),))


def _ths(f: list[str], vouched: bool) -> Iterator[Fact]:
    _need(f, 2, vouched)
    _letter(f, 1, "A E M S V", vouched)
    yield Fact("ths", (angle(f[0]),), status.heading(f[1]))


def _hdg(f: list[str], vouched: bool) -> Iterator[Fact]:
    """The compass, its deviation and the variation: the heading stays as it was read."""
    _need(f, 5, vouched)
    _letter(f, 2, "E W", vouched)
    _letter(f, 4, "E W", vouched)
    deviation, variation = east_positive(f[1], f[2]), east_positive(f[3], f[4])
    yield Fact("hdg", (angle(f[0]), variation, deviation))


def _hdm(f: list[str], vouched: bool) -> Iterator[Fact]:
    _need(f, 2, vouched)
    _letter(f, 1, "M", vouched)
    yield Fact("hdm", (angle(f[0]), BLANK, BLANK))


def _vhw(f: list[str], vouched: bool) -> Iterator[Fact]:
    """Heading true and magnetic, speed through the water in knots and km/h."""
    _need(f, 6, vouched)
    f.extend([""] * (8 - len(f)))
    for at, letter in ((1, "T"), (3, "M"), (5, "N")):
        _letter(f, at, letter, vouched)
    if f[0]:
        yield Fact("vhw", (angle(f[0]),))
    if f[2]:
        yield Fact("vhw_magnetic", (angle(f[2]), BLANK, BLANK))
    if f[4] or f[6]:
        speed = number(f[4]) * KNOT if f[4] else number(f[6]) * WIND_UNITS["K"]
        yield Fact("/speed/water", (speed,))


def _rot(f: list[str], vouched: bool) -> Iterator[Fact]:
    """Degrees a minute, negative where the bow turns to port."""
    _need(f, 2, vouched)
    _letter(f, 1, "A V", vouched)
    yield Fact("/gyro/rate", (number(f[0]) / 60.0,), status.valid(f[1]))


def _mwv(f: list[str], vouched: bool) -> Iterator[Fact]:
    """Where the wind blows from, against the bow in both references."""
    _need(f, 5, vouched)
    _letter(f, 4, "A V", vouched or not f[2])
    speed = number(f[2]) * WIND_UNITS.get(f[3], 1.0)
    topic = "mwv_t" if f[1] == "T" else "mwv_r"
    yield Fact(topic, (speed, angle(f[0])), status.valid(f[4]))


def _side(f: list[str], vouched: bool) -> tuple[float, float]:
    """Speed [m/s] and direction [deg] from the bow of VWR and VWT, whose angle goes up to 180."""
    _need(f, 4, vouched)
    f.extend([""] * (8 - len(f)))
    _letter(f, 1, "L R", vouched)
    _letter(f, 3, "N", vouched)
    direction = angle(f[0])
    speed = number(f[2]) * KNOT
    for at, factor in ((4, 1.0), (6, WIND_UNITS["K"])):
        speed = number(f[at]) * factor if math.isnan(speed) and f[at] else speed
    return speed, (360.0 - direction if f[1] == "L" else direction) % 360.0


def _vwr(f: list[str], vouched: bool) -> Iterator[Fact]:
    yield Fact("vwr", _side(f, vouched))


def _vwt(f: list[str], vouched: bool) -> Iterator[Fact]:
    yield Fact("vwt", _side(f, vouched))


def _mwd(f: list[str], vouched: bool) -> Iterator[Fact]:
    """Where the true wind blows from, against true north; knots, else m/s."""
    _need(f, 6, vouched)
    f.extend([""] * (8 - len(f)))
    _letter(f, 1, "T", vouched)
    _letter(f, 5, "N", vouched)
    speed = number(f[4]) * KNOT if f[4] else number(f[6])
    yield Fact("/wind/true_north", (speed, angle(f[0])))


def _rsa(f: list[str], vouched: bool) -> Iterator[Fact]:
    """The starboard, or the only, rudder and then port; negative turns the bow to port."""
    _need(f, 2, vouched)
    f.extend([""] * (4 - len(f)))
    for name, at in (("starboard", 0), ("port", 2)):
        _letter(f, at + 1, "A V", vouched)
        if f[at]:
            value = number(f[at])
            if abs(value) > LARGEST_RUDDER_DEG:
                raise ValueError(f[at])
            yield Fact(f"/rudder/{name}", (value,), status.valid(f[at + 1]))
        elif f[at + 1]:
            yield Fact(f"/rudder/{name}", (BLANK,), status.valid(f[at + 1]))


def _rpm(f: list[str], vouched: bool) -> Iterator[Fact]:
    """Of a shaft (S) or an engine (E), by its number: 0 is single or on the centre line, odd ones
    are to starboard. The pitch is per cent of its largest, negative astern."""
    _need(f, 5, vouched)
    if f[0] not in ("S", "E"):
        raise Cut
    name = f"{'engine' if f[0] == 'E' else 'shaft'}_{int(f[1] or 0)}"
    yield Fact(f"/propeller/{name}", (number(f[2]) * RPM,), status.valid(f[4]))
    if f[3]:
        yield Fact(f"/thruster/{name}_pitch", (number(f[3]) / 100.0,), status.valid(f[4]))


SENTENCES: dict[str, Callable[[list[str], bool], Iterator[Fact]]] = {
    "RMC": _rmc, "GGA": _gga, "GNS": _gns, "GLL": _gll, "VTG": _vtg, "HDT": _hdt, "THS": _ths,
    "HDG": _hdg, "HDM": _hdm, "VHW": _vhw, "ROT": _rot, "MWV": _mwv, "VWR": _vwr, "VWT": _vwt,
    "MWD": _mwd, "RSA": _rsa, "RPM": _rpm,
}  # fmt: skip
TIME_AT = {"RMC": 0, "GGA": 0, "GNS": 0, "ZDA": 0, "GLL": 4}  # which field is the UTC
