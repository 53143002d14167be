"""Draft a ship profile for a log nobody has described yet, from its topics, fields and units.

A draft is a proposal: what was guessed from a name says CHECK, what was not found says so.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from shiplog.exceptions import LogUnreadable, listed
from shiplog.logs.read import Contents, contents, fields

SUFFIX = {  # how a field's name ends, and the unit it so declares
    "degps": "deg/s", "deg_s": "deg/s", "radps": "rad/s", "rad_s": "rad/s", "mps": "m/s",
    "m_s": "m/s", "kn": "kn", "knots": "kn", "kmh": "km/h", "deg": "deg", "rad": "rad",
    "rps": "rps", "rpm": "rpm", "pct": "%", "us": "pwm", "m": "m",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Guess:
    """One way a channel may stand in a log: the fields' names and what they mean."""

    kind: str
    patterns: tuple[str, ...]
    unit: str
    topic: str = ""


GUESSES = {  # in order of trust; the first that matches is taken
    "position": (
        Guess("geodetic", (r"lat(itude)?(_deg)?$", r"lon(gitude)?(_deg)?$"), "deg"),
        Guess("local", (r"x0?(_m)?$", r"y0?(_m)?$"), "m", r"local|pos|pose|state|ned"),
        Guess("local", (r"north(_m)?$", r"east(_m)?$"), "m"),
    ),
    "velocity": (
        Guess("sog_cog", (r"sog(_\w+)?$|speed(_\w+)?$", r"cog(_\w+)?$|course(_\w+)?$"), "m/s deg"),
        Guess("body", (r"(surge|ahead)(_\w+)?$", r"(sway|starboard)(_\w+)?$"), "m/s"),
        Guess("ned", (r"(v_?n|north)(_\w+)?$", r"(v_?e|east)(_\w+)?$"), "m/s", r"vel|gnss|gps|ned"),
        Guess("enu", (r"linear\.x$", r"linear\.y$"), "m/s", r"enu|gnss|gps|fix"),
        Guess("body", (r"linear\.x$", r"linear\.y$"), "m/s", r"twist|vel|odom"),
    ),
    "heading": (
        Guess("angle", (r"(true_?)?(heading|hdg|psi|yaw)(_deg|_rad)?$",), "deg"),
        Guess("quaternion_enu", (r"(orientation|quaternion|rotation)[._]z$",
                                 r"(orientation|quaternion|rotation)[._]w$"), "1"),
    ),
    "yaw_rate": (
        Guess("rate", (r"(yaw_?rate|rot|rate_of_turn)(_\w+)?$",), "deg/s"),
        Guess("rate", (r"angular(_velocity)?\.z$",), "rad/s"),
    ),
    "wind": (
        Guess("from_bow", (r"speed(_\w+)?$", r"(direction|angle)(_\w+)?$"), "m/s deg",
              r"wind|anemo"),
    ),
}  # fmt: skip
ACTUATORS = (  # kind, in the topic's name, and the field that holds the value
    ("rudder", r"rudder|steer", r"angle(_\w+)?$|position(_\w+)?$|data$", "deg"),
    ("propeller", r"prop|shaft|engine", r"(speed|rpm|rps|revs)(_\w+)?$|data$", "rps"),
    ("azimuth", r"azimuth|azipod", r"angle(_\w+)?$|data$", "deg"),
    (
        "thruster",
        r"thrust|motor|esc",
        r"(command|speed|rpm|motor_speed|throttle)(_\w+)?$|data$",
        "1",
    ),
)


def draft(path: str | Path) -> str:
    """TOML text of a profile for this log. Raises LogUnreadable where it has no field at all."""
    found = contents(path)
    leaves = {topic: tuple(columns) for topic, columns in fields(path).items() if columns}
    if not leaves:
        raise LogUnreadable(
            f"{found.path.name} has no topic that can be decoded.",
            hint="`shiplog check` says why, topic by topic.",
        )
    used: set[str] = set()
    parts = [_ship(found)]
    parts += [_sensor(name, found, leaves, used) for name in GUESSES]
    actuators = list(_actuators(found, leaves, used))
    parts += actuators or [
        "# No actuator was recognised. Each needs a section like this one:\n"
        '# [[actuators]]\n# name = "rudder"\n# kind = "rudder"\n'
        '# topic = "/rudder/main"\n# field = "angle_deg"\n# unit = "deg"\n'
    ]
    unused = sorted(set(leaves) - used)
    if unused:
        parts.append("# Topics not used: " + listed(unused, most=40) + "\n")
    return "\n".join(parts)


def _ship(found: Contents) -> str:
    name = found.metadata.get("voyage", {}).get("ship") or found.path.stem
    return (
        f"# Drafted from {found.path.name}. Look over every line that says CHECK.\n\n"
        f'[ship]\nname = "{name}"\nlength_m = 1.0  # CHECK: the log does not say\n'
    )


def _sensor(name: str, found: Contents, leaves: dict[str, tuple[str, ...]], used: set[str]) -> str:
    for guess in GUESSES[name]:
        for topic, columns in sorted(leaves.items(), key=lambda item: name not in item[0]):
            if not re.search(guess.topic, topic, re.IGNORECASE):
                continue
            matched = [_first(pattern, columns) for pattern in guess.patterns]
            if any(m is None for m in matched):
                continue
            used.add(topic)
            return _section(name, guess, topic, [m for m in matched if m], found)
    optional = name in ("yaw_rate", "wind")
    return f"# No {name} was recognised{'; shiplog does without it' if optional else ''}.\n"


def _section(name: str, guess: Guess, topic: str, paths: list[str], found: Contents) -> str:
    fallback = guess.unit.split()
    fallback = fallback * len(paths) if len(fallback) == 1 else fallback
    known = [_unit(path, topic, found) for path in paths]
    said = [unit or other for unit, other in zip(known, fallback, strict=True)]
    sure = all(known) or guess.kind.startswith("quaternion")
    lines = [f"[sensors.{name}]", f'kind = "{guess.kind}"', f'topic = "{topic}"']
    quoted = ", ".join(f'"{p}"' for p in paths)
    lines.append(f"fields = [{quoted}]" if len(paths) > 1 else f"field = {quoted}")
    check = "" if sure else "  # CHECK: the log does not say"
    if len(set(said)) == 1:
        lines.append(f'unit = "{said[0]}"{check}')
    else:
        lines.append("units = [" + ", ".join(f'"{u}"' for u in said) + f"]{check}")
    if name in ("position", "velocity"):
        lines.append("lever_arm_m = [0.0, 0.0]  # CHECK: antenna ahead and to starboard of midship")
    return "\n".join(lines) + "\n"


def _actuators(
    found: Contents, leaves: dict[str, tuple[str, ...]], used: set[str]
) -> Iterator[str]:
    for kind, in_topic, in_field, fallback in ACTUATORS:
        for topic, columns in sorted(leaves.items()):
            if topic in used or not re.search(in_topic, topic, re.IGNORECASE):
                continue
            path = _first(in_field, columns)
            if path is None:
                continue
            used.add(topic)
            unit = _unit(path, topic, found)
            check = "" if unit else "  # CHECK: the log does not say"
            name = re.sub(r"\W+", "_", topic.strip("/")).strip("_").lower()
            if name[:1].isdigit():
                name = f"{kind}_{name}"
            yield (
                f'[[actuators]]\nname = "{name}"\nkind = "{kind}"\ntopic = "{topic}"\n'
                f'field = "{path}"\nunit = "{unit or fallback}"{check}\n'
            )


def _first(pattern: str, columns: tuple[str, ...]) -> str | None:
    """The shallowest field whose last name, or whose path's end, matches."""
    matching = [c for c in columns if re.search(rf"(^|\.)({pattern})", c, re.IGNORECASE)]
    return min(matching, key=lambda c: (c.count("."), len(c))) if matching else None


def _unit(path: str, topic: str, found: Contents) -> str | None:
    """What the channel's metadata or the field's own name says."""
    lowered = path.rsplit(".", 1)[-1].lower()
    for suffix, unit in SUFFIX.items():
        if lowered.endswith(f"_{suffix}"):
            return unit
    if lowered in ("latitude", "longitude"):
        return "deg"
    return found.topics[topic].metadata.get("unit") if topic in found.topics else None
