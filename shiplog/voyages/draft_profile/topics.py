"""A profile from the topics of an MCAP log: instruments before set-points, and what they hold."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from shiplog.exceptions import LogUnreadable, ProfileError, listed
from shiplog.logs.read import Contents, contents, fields, read
from shiplog.voyages.draft_profile import facts, words

MMSI = re.compile(r"(?<![^/])\d{7,9}(?![^/])")  # 7 of a base station, whose zeros are lost
LOOKED_AT = 4  # of the topics that may hold a channel: the first of them with data is drafted
SEARCHED = 200  # topics whose data are read at most, for the comments of the lines


@dataclass(frozen=True, slots=True)
class Guess:
    """One way a channel may stand in a log: the fields' names and what they mean."""

    kind: str
    patterns: tuple[str, ...]
    unit: str
    topic: str = ""
    check: str = ""  # what no name can say


ENU = 'CHECK: ROS turns from east; some compasses write "quaternion_ned"'
AXES_TO_CHECK = 'CHECK: axes of the ship; or "enu", "ned" of the earth'
LINEAR = (r"(twist_)?linear[._]x$", r"(twist_)?linear[._]y$")
GUESSES = {  # in order of trust, after that of the topics themselves
    "position": (
        Guess("geodetic", (r"lat(itude)?(_deg)?$", r"lon(gitude)?(_deg)?$"), "deg"),
        Guess("local", (r"x0?(_m)?$", r"y0?(_m)?$"), "m", r"local|pos|pose|state|ned"),
        Guess("local", (r"north(_m)?$", r"east(_m)?$"), "m"),
    ),
    "velocity": (
        Guess("sog_cog", (r"sog(_\w+)?$|speed(_\w+)?$", r"cog(_\w+)?$|course(_\w+)?$"), "m/s deg"),
        Guess("body", (r"(surge|ahead)(_\w+)?$", r"(sway|starboard)(_\w+)?$"), "m/s"),
        Guess("ned", (r"(v_?n|north)(_\w+)?$", r"(v_?e|east)(_\w+)?$"), "m/s", r"vel|gnss|gps|ned"),
        Guess("enu", LINEAR, "m/s", r"enu|gnss|gps|fix"),
        Guess("body", LINEAR, "m/s", r"twist|vel|odom", AXES_TO_CHECK),
    ),
    "heading": (
        Guess("angle", (r"(true_?)?(heading|hdg|psi|yaw)(_deg|_rad)?$",), "deg"),
        Guess("quaternion_enu", (r"(orientation|quaternion|rotation)[._]z$",
                                 r"(orientation|quaternion|rotation)[._]w$"), "1", "", ENU),
    ),
    "yaw_rate": (
        Guess("rate", (r"(yaw_?rate|rot|rate_of_turn)(_\w+)?$",), "deg/s"),
        Guess("rate", (r"angular(_velocity)?[._]z$",), "rad/s"),
    ),
    "wind": (
        Guess("from_bow", (r"speed(_\w+)?$", r"(direction|angle)(_\w+)?$"), "m/s deg",
              r"wind|anemo"),
    ),
}  # fmt: skip
ACTUATOR_TOPICS = (  # kind, in the topic's name, and the field that holds the value
    ("rudder", r"rudder|steer", r"angle(_\w+)?$|position(_\w+)?$|data$", "deg"),
    ("propeller", r"prop|shaft|engine", r"(speed|rpm|rps|revs)(_\w+)?$|data$", "rps"),
    ("azimuth", r"azimuth|azipod", r"angle(_\w+)?$|data$", "deg"),
    (
        "thruster",
        r"thrust|motor|esc|actuator",
        r"(command|speed|rpm|motor_speed|throttle)(_\w+)?$|data$",
        "1",
    ),
)


@dataclass(frozen=True, slots=True)
class Choice:
    """A topic that may hold a channel."""

    topic: str
    paths: tuple[str, ...]
    guess: Guess


class Log:
    """A log as a draft looks at it: its topics' fields, and their data once it is known which."""

    def __init__(self, path: str | Path, vessel: str | None) -> None:
        self.contents: Contents = contents(path)
        leaves = {topic: tuple(columns) for topic, columns in fields(path).items() if columns}
        if not leaves:
            raise LogUnreadable(
                f"{self.contents.path.name} has no topic that can be decoded.",
                hint="`shiplog check` says why, topic by topic.",
            )
        self.leaves = _of_one_vessel(leaves, vessel, self.contents)
        self.data: dict[str, pl.DataFrame] = {}

    def look(self, wanted: dict[str, set[str]]) -> None:
        """Read the topics of the draft that were not read yet."""
        if wanted:
            self.data |= read(self.contents.path, dict(list(wanted.items())[:SEARCHED])).frames

    def holds(self, choice: Choice) -> bool:
        """Whether any value stands where a channel is looked for."""
        frame = self.data.get(choice.topic)
        if frame is None or not set(choice.paths) <= set(frame.columns):
            return False
        numbers = [frame[p].cast(pl.Float64, strict=False).is_finite() for p in choice.paths]
        return all(bool(finite.any()) for finite in numbers)

    def rate(self, topic: str) -> str:
        frame = self.data.get(topic)
        return facts.of_times(frame["log_time"]) if frame is not None else "no message"

    def values(self, topic: str, path: str) -> str:
        frame = self.data.get(topic)
        return facts.of_values(frame[path]) if frame is not None and path in frame else "unread"

    def unit(self, path: str, topic: str) -> str | None:
        """What the field's own name or the channel's metadata says."""
        return words.unit_of(path) or self.contents.topics[topic].metadata.get("unit")


def draft(path: str | Path, vessel: str | None = None) -> str:
    """TOML text of a profile for this log.

    vessel  the MMSI of the ship, where the log is of many

    Raises LogUnreadable where it has no field at all, ProfileError where it is of many ships.
    """
    log = Log(path, vessel)
    choices = {name: _choices(name, log.leaves) for name in GUESSES}
    near = _receiver(choices["position"])
    if near:  # what else the same receiver sends is of GNSS too, whatever its topic is called
        choices["velocity"] = _choices("velocity", log.leaves, near)
        choices["heading"] = _choices("heading", log.leaves, near)
    log.look(_fields_of(choice for found in choices.values() for choice in found[:LOOKED_AT]))
    choices = {
        name: [c for c in found[:LOOKED_AT] if log.holds(c)] or found[:1]
        for name, found in choices.items()
    }
    best = [found[0] for found in choices.values() if found]
    driven = list(_actuators(log.leaves, {choice.topic for choice in best}))
    log.look({topic: {field_} for _, topic, field_, _ in driven})
    parts = [_ship(log.contents)]
    parts += [_sensor(name, found, log) for name, found in choices.items()]
    parts += [_actuator(*one, log=log) for one in driven] or [NO_ACTUATOR]
    listed_first = [choice for found in choices.values() for choice in found[:2]]
    used = {*(choice.topic for choice in listed_first), *(topic for _, topic, _, _ in driven)}
    unused = sorted(set(log.leaves) - used)
    if unused:
        parts.append("# Topics not used: " + listed(unused, most=40) + "\n")
    return "\n".join(parts)


NO_ACTUATOR = (
    "# No actuator was recognised: the log can be ingested and its sensors checked, but no model\n"
    "# trained. Each actuator needs a section like this one:\n"
    '# [[actuators]]\n# name = "rudder"\n# kind = "rudder"\n'
    '# topic = "/rudder/main"\n# field = "angle_deg"\n# unit = "deg"\n'
)


def _fields_of(choices: Iterable[Choice]) -> dict[str, set[str]]:
    wanted: dict[str, set[str]] = {}
    for choice in choices:
        wanted.setdefault(choice.topic, set()).update(choice.paths)
    return wanted


def _of_one_vessel(
    leaves: dict[str, tuple[str, ...]], vessel: str | None, found: Contents
) -> dict[str, tuple[str, ...]]:
    """Without the topics of other ships. Raises ProfileError where no ship was chosen."""
    counts: dict[str, int] = {}
    for topic in leaves:
        if match := MMSI.search(topic):
            counts[match[0]] = counts.get(match[0], 0) + (found.topics[topic].messages or 0)
    if len(counts) < 2 and vessel is None:
        return leaves
    if vessel is None or vessel not in counts:
        raise ProfileError(
            f"{found.path.name} holds {len(counts)} vessels"
            f"{'' if vessel is None else f', and none is {vessel}'}: "
            f"{facts.counted(counts, 'messages')}.",
            hint="say which with --vessel, by its MMSI.",
        )
    return {
        topic: paths
        for topic, paths in leaves.items()
        if not (match := MMSI.search(topic)) or match[0] == vessel
    }


def _ship(found: Contents) -> str:
    name = found.metadata.get("voyage", {}).get("ship") or found.path.stem
    return (
        f"# Drafted from {found.path.name}. Look over every line that says CHECK.\n\n"
        f'[ship]\nname = "{name}"\nlength_m = 1.0  # CHECK: the log does not say\n'
    )


def _choices(name: str, leaves: dict[str, tuple[str, ...]], near: str = "") -> list[Choice]:
    """Every topic that may hold a channel, the most trusted first."""
    found: list[tuple[tuple, Choice]] = []
    for topic, columns in leaves.items():
        called = f"{topic} gnss" if near and topic.startswith(near) else topic
        for order, guess in enumerate(GUESSES[name]):
            if not re.search(guess.topic, called, re.IGNORECASE):
                continue
            paths = [_first(pattern, columns) for pattern in guess.patterns]
            if any(p is None for p in paths):
                continue
            whole = tuple(p for p in paths if p)
            key = (*words.trust(name, called), order, name not in topic, topic)
            found.append((key, Choice(topic, whole, guess)))
            break
    return [choice for _, choice in sorted(found, key=lambda item: item[0])]


def _receiver(positions: list[Choice]) -> str:
    """The folder of topics that the GNSS receiver's fix stands in, if it has one."""
    if not positions or positions[0].guess.kind != "geodetic":
        return ""
    folder = positions[0].topic.rpartition("/")[0]
    return folder + "/" if folder else ""


def _sensor(name: str, choices: list[Choice], log: Log) -> str:
    if not choices:
        optional = name in ("yaw_rate", "wind")
        return f"# No {name} was recognised{'; shiplog does without it' if optional else ''}.\n"
    text = _section(name, choices[0], log)
    for second in choices[1:2]:
        quoted = ", ".join(f'"{p}"' for p in second.paths)
        text += (
            f'# Second choice: kind = "{second.guess.kind}", topic = "{second.topic}", '
            f"fields = [{quoted}]  # {log.rate(second.topic)}\n"
        )
    return text


def _section(name: str, choice: Choice, log: Log) -> str:
    guess, topic, paths = choice.guess, choice.topic, choice.paths
    fallback = guess.unit.split()
    fallback = fallback * len(paths) if len(fallback) == 1 else fallback
    known = [log.unit(path, topic) for path in paths]
    units = [unit or other for unit, other in zip(known, fallback, strict=True)]
    sure = all(known) or guess.kind.startswith("quaternion")
    ordered = "CHECK: a set-point, not a measurement; " if words.is_set_point(topic) else ""
    lines = [f"[sensors.{name}]"]
    lines.append(f'kind = "{guess.kind}"' + (f"  # {guess.check}" if guess.check else ""))
    lines.append(f'topic = "{topic}"  # {ordered}{log.rate(topic)}')
    quoted = ", ".join(f'"{p}"' for p in paths)
    lines.append(f"fields = [{quoted}]" if len(paths) > 1 else f"field = {quoted}")
    lines += [f"#   {path}: {log.values(topic, path)}" for path in paths]
    check = "" if sure else "  # CHECK: the log does not say"
    if len(set(units)) == 1:
        lines.append(f'unit = "{units[0]}"{check}')
    else:
        lines.append("units = [" + ", ".join(f'"{u}"' for u in units) + f"]{check}")
    if name in ("position", "velocity"):
        lines.append("lever_arm_m = [0.0, 0.0]  # CHECK: antenna ahead and to starboard of midship")
    return "\n".join(lines) + "\n"


def _actuators(
    leaves: dict[str, tuple[str, ...]], used: set[str]
) -> Iterator[tuple[str, str, str, str]]:
    """Kind, topic, field and fallback unit of each; orders only of a kind that nobody measured."""
    taken = set(used)
    measured = {topic: paths for topic, paths in leaves.items() if not words.is_set_point(topic)}
    kinds: set[str] = set()
    for source in (measured, leaves):
        for kind, in_topic, in_field, fallback in ACTUATOR_TOPICS:
            if kind in kinds and source is leaves:
                continue
            for topic, columns in sorted(source.items()):
                if topic in taken or not re.search(in_topic, topic, re.IGNORECASE):
                    continue
                path = _first(in_field, columns)
                if path is None:
                    continue
                taken.add(topic)
                if source is measured:
                    kinds.add(kind)
                elif kinds & {"thruster", "propeller"} and kind in ("thruster", "propeller"):
                    continue  # the order of what is measured as the other of the two
                yield kind, topic, path, fallback


def _actuator(kind: str, topic: str, path: str, fallback: str, *, log: Log) -> str:
    unit = log.unit(path, topic)
    check = "" if unit else "  # CHECK: the log does not say"
    ordered = "CHECK: a set-point, what was ordered; " if words.is_set_point(topic) else ""
    name = re.sub(r"\W+", "_", topic.strip("/")).strip("_").lower()
    if name[:1].isdigit():
        name = f"{kind}_{name}"
    return (
        f'[[actuators]]\nname = "{name}"\nkind = "{kind}"\n'
        f'topic = "{topic}"  # {ordered}{log.rate(topic)}\n'
        f'field = "{path}"  # {log.values(topic, path)}\nunit = "{unit or fallback}"{check}\n'
    )


def _first(pattern: str, columns: tuple[str, ...]) -> str | None:
    """The shallowest field whose last name, or whose path's end, matches."""
    matching = [c for c in columns if re.search(rf"(^|\.)({pattern})", c, re.IGNORECASE)]
    return min(matching, key=lambda c: (c.count("."), len(c))) if matching else None
