"""How instruments, set-points and units are called in topics, fields and columns."""

from __future__ import annotations

import re

SUFFIX = {  # how a name ends, and the unit it so declares; the longest ending counts
    "degps": "deg/s", "deg_s": "deg/s", "radps": "rad/s", "rad_s": "rad/s", "mps": "m/s",
    "degpmin": "deg/min", "deg_min": "deg/min",
    "m_s": "m/s", "ms": "m/s", "kn": "kn", "kts": "kn", "knots": "kn", "kmh": "km/h",
    "deg": "deg", "rad": "rad", "rps": "rps", "rpm": "rpm", "pct": "%", "us": "pwm", "m": "m",
}  # fmt: skip
SPELLED = {  # a unit as people write it, and as it is called here
    "°": "deg", "degree": "deg", "degrees": "deg", "kt": "kn", "kts": "kn", "knot": "kn",
    "°/s": "deg/s", "deg/sec": "deg/s", "rad/sec": "rad/s", "°/min": "deg/min", "m/sec": "m/s",
    "m s-1": "m/s", "kmh": "km/h", "kph": "km/h", "1/s": "rps", "hz": "rps", "1/min": "rpm",
    "u/min": "rpm", "sec": "s", "msec": "ms", "usec": "us", "µs": "us", "percent": "%", "-": "1",
}  # fmt: skip
_EDGE = r"(?:^|[/_.\s\-])"
_SET_POINT = re.compile(
    _EDGE + r"(reference|ref|cmd|command|commanded|desired|des|guidance|set_?point|sp|target|"
    r"order|ordered|waypoint|goal)(?=[/_.\s\-\d]|$)",
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


def is_set_point(name: str) -> bool:
    """Whether a topic or column says what was ordered and not what was measured."""
    return bool(_SET_POINT.search(name))


def is_derived(name: str) -> bool:
    """Whether it is an acceleration, an accuracy or a difference of what the name says."""
    return bool(_DERIVED.search(name))


def trust(channel: str, name: str) -> tuple[int, int, int, int]:
    """Sort key: instruments, then anything, then estimates, derived values, set-points."""
    return (
        is_set_point(name),
        is_derived(name),
        bool(_ESTIMATE.search(name)),
        not re.search(_INSTRUMENT.get(channel, "^$"), name, re.IGNORECASE),
    )


def unit_of(name: str) -> str | None:
    """The unit that a field's or column's name declares: `sog_kn`, `speed [m/s]`, `n (rpm)`."""
    if bracket := re.search(r"[\[(]\s*([^\])]+?)\s*[\])]\s*$", name):
        return spelled(bracket[1])
    lowered = name.rsplit(".", 1)[-1].strip().lower()
    for suffix in sorted(SUFFIX, key=len, reverse=True):
        if lowered.endswith(f"_{suffix}") or lowered.endswith(f" {suffix}"):
            return SUFFIX[suffix]
    return "deg" if lowered in ("latitude", "longitude", "lat", "lon") else None


def spelled(text: str) -> str | None:
    """A unit that somebody wrote, as it is called here; None for one that is not known."""
    from shiplog.units import TO_SI

    lowered = text.strip().strip("[]()").lower()
    known = SPELLED.get(lowered, lowered)
    return known if known in TO_SI else None


def bare(name: str) -> str:
    """A column's name without unit, case or signs: `SOG [kn]` and `sog_kn` are both `sog`."""
    name = re.sub(r"\s*[\[(][^\])]*[\])]\s*$", "", name).strip().lower()
    plain = re.sub(r"[^0-9a-zµ]+", "_", name).strip("_")
    for suffix in sorted(SUFFIX, key=len, reverse=True):
        if plain.endswith(f"_{suffix}"):
            return plain.removesuffix(f"_{suffix}")
    return plain
