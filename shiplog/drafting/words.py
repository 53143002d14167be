"""How instruments, set-points and units are called in topics, fields and columns."""

from __future__ import annotations

import re
from collections.abc import Collection

from shiplog.nomenclature import units

SUFFIX = {  # how a name ends, and the unit it so declares; the longest ending counts
    "degps": "deg/s", "deg_s": "deg/s", "radps": "rad/s", "rad_s": "rad/s", "mps": "m/s",
    "degpmin": "deg/min", "deg_min": "deg/min",
    "m_s": "m/s", "ms": "m/s", "kn": "kn", "kts": "kn", "knots": "kn", "kmh": "km/h",
    "deg": "deg", "rad": "rad", "rps": "rps", "rpm": "rpm", "pct": "%", "us": "pwm", "m": "m",
}  # fmt: skip
SPELLED = {  # a unit as people write it, and as it is called here
    "°": "deg", "degree": "deg", "degrees": "deg", "°t": "deg", "kt": "kn", "kts": "kn",
    "knot": "kn", "°/s": "deg/s", "deg/sec": "deg/s", "rad/sec": "rad/s", "°/min": "deg/min",
    "m/sec": "m/s", "m s-1": "m/s", "kmh": "km/h", "kph": "km/h", "1/s": "rps", "hz": "rps",
    "1/min": "rpm", "u/min": "rpm", "sec": "s", "msec": "ms", "usec": "us", "µs": "us",
    "percent": "%", "-": "1",
}  # fmt: skip
CASED = frozenset({"kN", "M", "S"})  # kilonewtons, magnetic, south: no knots, metres, seconds
TWO_MEANINGS = {  # (a unit, what is measured): the unit that is meant then
    ("ms", "speed"): "m/s", ("m/s", "time"): "ms",
    ("us", "servo pulse"): "pwm", ("pwm", "time"): "us",
}  # fmt: skip
_FOREIGN = re.compile(  # units of forces, powers, pressures, flows: of no channel
    r"[kMm]?(N|Nm|W|Wh|VA|V|A|Pa|J|bar)|hPa|°C|degC|deg C|kg|t/h|l/h|L/h|kg/h|m/s\^?[2²]|m[3³]/h"
)
_EDGE = r"(?:^|[/_.\s\-])"
_SET_POINT = re.compile(
    _EDGE + r"(reference|ref|cmd|command|commanded|desired|des|guidance|set_?point|sp|target|"
    r"order|ordered|waypoint|goal|set)(?=[/_.\s\-\d]|$)",
    re.IGNORECASE,
)
_ESTIMATE = re.compile(
    _EDGE + r"(nav|navigation|estimat\w*|ekf|filter\w*|kalman|odom\w*|sim\w*|predict\w*)"
    r"(?=[/_.\s\-\d]|$)", re.IGNORECASE,
)  # fmt: skip
_DERIVED = re.compile(r"accel|_dot(?=$|[_/.])|jerk|covariance|std|error|diff", re.IGNORECASE)
_INSTRUMENT = {  # what measures a channel at first hand
    "position": r"gnss|gps|fix|rtk|dgps",
    "velocity": r"gnss|gps|fix|rtk",
    "heading": r"compass|gyro|hdt|gnss|gps|heading",
    "yaw_rate": r"gyro|imu|rot",
    "wind": r"apparent|relative|anemo|mwv",
}
_TRUE_WIND = re.compile(r"(?<![a-z])(true(wind)?|tw[asd]|mwd|ground)(?![a-z])")
_APPARENT = re.compile(r"(?<![a-z])(app|apparent|rel|relative|aw[asd])(?![a-z])")
_MAGNETIC = re.compile(r"\(m\)|\[m\]|magnetic|(?<![a-z])(mag|hdm)(?![a-z])")
_SHAFT = re.compile(r"(?<![a-z])(rpm|rps)(?![a-z])")


_DRIVES = re.compile(
    r"(?<![a-z])(ruds?|rudders?|helm|steer\w*|thr|thrust\w*|throttle|motors?|esc|servo\d*|pwm|"
    r"propellers?|props?|rpm|shaft|azi\w*|pod|pods|jet|jets|waterjet|engine\w*|nozzle|bucket|"
    r"bow_?thr\w*|stern_?thr\w*)(?![a-z])"
)
_NOT_DRIVING = re.compile(
    r"zero|neutral|force|torque|power|current|voltage|temp|fuel|press|load|mode|status|state|alarm|"
    r"_kw|_n$|hours|level|error|trim"
)


def drives(name: str) -> bool:
    """Whether a topic or column is called like something that moves the ship."""
    called = parted(name)
    return bool(_DRIVES.search(called)) and not _NOT_DRIVING.search(called)


def parted(name: str) -> str:
    """A name in small letters, with an underscore where a capital began a word: `windTrue`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def is_set_point(name: str) -> bool:
    """Whether a topic or column says what was ordered and not what was measured."""
    return bool(_SET_POINT.search(name) or _SET_POINT.search(parted(name)))


def is_derived(name: str) -> bool:
    """Whether it is an acceleration, an accuracy or a difference of what the name says."""
    return bool(_DERIVED.search(name))


def is_true_wind(name: str) -> bool:
    """Whether it is the wind over ground: shiplog takes the apparent wind."""
    return bool(_TRUE_WIND.search(parted(name)))


def is_apparent(name: str) -> bool:
    """Whether its wind is the one that the ship feels, by its name."""
    return bool(_APPARENT.search(parted(name)))


def is_magnetic(name: str) -> bool:
    """Whether it is a magnetic compass's heading or course: off by the variation."""
    return bool(_MAGNETIC.search(parted(name)))


def trust(channel: str, name: str) -> tuple[int, int, int, int]:
    """Sort key: instruments, then anything, then estimates, derived values, set-points."""
    return (
        is_set_point(name),
        is_derived(name),
        bool(_ESTIMATE.search(name)),
        not re.search(_INSTRUMENT.get(channel, "^$"), name, re.IGNORECASE),
    )


def unit_of(name: str) -> str | None:
    """The unit that a field's or column's name declares: `sog_kn`, `speed [m/s]`, `RPM (port)`."""
    if bracket := re.search(r"[\[(]\s*([^\])]+?)\s*[\])]\s*$", name):
        if unit := spelled(bracket[1]):
            return unit
        if is_foreign(name):
            return None
        name = name[: bracket.start()]
    last = name.rsplit(".", 1)[-1].strip()
    lowered = last.lower()
    for suffix in sorted(SUFFIX, key=len, reverse=True):
        if lowered.endswith(f"_{suffix}") or lowered.endswith(f" {suffix}"):
            return SUFFIX[suffix]
    if shaft := _SHAFT.search(parted(last)):
        return shaft[1]
    return "deg" if lowered in ("latitude", "longitude", "lat", "lon") else None


def fitting(unit: str | None, takes: Collection[str]) -> str | None:
    """A stated unit as what it can only mean where `takes` is measured; None for none that does."""
    if unit is None or units.measure(unit) in takes:
        return unit
    return next((TWO_MEANINGS[unit, one] for one in takes if (unit, one) in TWO_MEANINGS), None)


def stated(name: str, row: str, takes: Collection[str]) -> tuple[bool, str | None]:
    """(whether a column may measure `takes`, the unit that its name or the row of units states).

    A last `_m` is no metre where none is measured: it may be short for measured or magnetic.
    """
    if is_foreign(name) or _FOREIGN.fullmatch(row.strip().strip("[]()")):
        return False, None
    unit = unit_of(name) or spelled(row)
    fits = fitting(unit, takes)
    return fits is not None or unit is None or unit == "m", fits


def is_foreign(name: str) -> bool:
    """Whether a name states a unit that no channel has, such as `thrust [kN]`."""
    bracket = re.search(r"[\[(]\s*([^\])]+?)\s*[\])]\s*$", name)
    return bool(bracket and _FOREIGN.fullmatch(bracket[1]))


def spelled(text: str) -> str | None:
    """A unit that somebody wrote, as it is called here; None for one that is not known."""
    plain = text.strip().strip("[]()").strip()
    if plain in CASED:
        return None
    known = SPELLED.get(plain.lower(), plain.lower())
    return known if known in units.TO_SI else None


def bare(name: str) -> str:
    """A column's name without unit, case or signs: `SOG [kn]` and `sog_kn` are both `sog`."""
    plain = re.sub(r"[^0-9a-zµ]+", "_", without_unit(name).lower()).strip("_")
    for suffix in sorted(SUFFIX, key=len, reverse=True):
        if plain.endswith(f"_{suffix}"):
            return plain.removesuffix(f"_{suffix}")
    return plain


def without_unit(name: str) -> str:
    """A column's name without what stands last in brackets."""
    return re.sub(r"\s*[\[(][^\])]*[\])]\s*$", "", name).strip()
