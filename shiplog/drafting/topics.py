"""A profile from the topics of an MCAP log: instruments before set-points, and what they hold."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.drafting import accuracy, facts, guesses, particulars, stated, words
from shiplog.drafting.guesses import ACTUATOR_TOPICS, GUESSES
from shiplog.drafting.log_content import Choice, Log
from shiplog.drafting.toml_text import in_comment, quoted
from shiplog.drafting.topic_motion import Agreement, Fields, Scales, scales
from shiplog.exceptions import listed
from shiplog.logs.reading.read import Contents
from shiplog.nomenclature import units
from shiplog.ship_profile.units_of_channels import DRIVEN

LOOKED_AT = 8  # of the topics that may hold a channel: the first of them with data is drafted
OPTIONAL = ("velocity", "yaw_rate", "wind")  # left out where no topic holds a value


def draft(path: str | Path, vessel: str | None = None, given: str | None = None) -> str:
    """TOML text of a profile for this log.

    vessel  the MMSI of the ship, where the log is of many
    given   the name of the file that the log was made of, if it was

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
        name: [c for c in found[:LOOKED_AT] if log.holds(c)]
        or [c for c in found[:1] if name not in OPTIONAL]
        for name, found in choices.items()
    }
    choices = {name: log.liveliest(found) for name, found in choices.items()}
    best = [found[0] for found in choices.values() if found]
    driven = _actuators(log, {choice.topic for choice in best})
    parts = [_ship(log.contents, given, any(stated.actuator(log.said(one[1])) for one in driven))]
    agreement = Agreement()
    sections = {
        name: _sensor(name, choices[name], log, agreement)
        for name in sorted(choices, key=IN_TURN.index)
    }
    parts += [sections[name] for name in choices]
    names: set[str] = set()
    parts += [_actuator(*one, names, log=log) for one in driven] or [NO_ACTUATOR]
    listed_first = [choice for found in choices.values() for choice in found[:2]]
    used = {*(choice.topic for choice in listed_first), *(topic for _, topic, _, _ in driven)}
    unused = sorted(set(log.leaves) - used)
    if alike := [topic for topic in unused if words.drives(topic)]:
        named = in_comment(listed(alike, most=40))
        parts.append(f"# CHECK: called like an actuator, and not used: {named}\n")
        unused = [topic for topic in unused if topic not in alike]
    if unused:
        parts.append("# Topics not used: " + in_comment(listed(unused, most=40)) + "\n")
    return "\n".join(parts)


LEVER_ARM = "lever_arm_m = [0.0, 0.0]  # CHECK: antenna ahead and to starboard of midship"
IN_TURN = ("position", "heading", "velocity", "yaw_rate", "wind")  # each goes by those before it
NEEDED = "a voyage needs it: record it, or name its topic here"
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


def _ship(found: Contents, given: str | None, by_recorder: bool) -> str:
    name = found.metadata.get("voyage", {}).get("ship") or found.path.stem
    return (
        f"# Drafted from {in_comment(given or found.path.name)}. "
        "Look over every line that says CHECK.\n\n"
        f"[ship]\nname = {quoted(name)}\n"
        + (particulars.STATED if by_recorder else particulars.SHIP).format(what="log")
    )


def _choices(name: str, leaves: dict[str, tuple[str, ...]], near: str = "") -> list[Choice]:
    """Every topic that may hold a channel, the most trusted first."""
    found: list[tuple[tuple, Choice]] = []
    for topic, columns in leaves.items():
        called = f"{topic} gnss" if near and topic.startswith(near) else topic
        for order, guess in enumerate(GUESSES[name]):
            if not re.search(guess.topic, called, re.IGNORECASE):
                continue
            takes = guesses.measures(name, guess.kind, len(guess.patterns))
            paths = [
                guesses.first(pattern, columns, (of_one,))
                for pattern, of_one in zip(guess.patterns, takes, strict=True)
            ]
            if any(p is None for p in paths):
                continue
            if name == "wind" and words.is_true_wind(" ".join((topic, *filter(None, paths)))):
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


def _sensor(name: str, choices: list[Choice], log: Log, agreement: Agreement) -> str:
    if not choices:
        does = "shiplog does without it" if name in OPTIONAL else NEEDED
        return f"# No {name} was recognised; {does}.\n"
    text = _section(name, choices[0], log, agreement)
    for second in choices[1:2]:
        kind, _ = guesses.kind_of(second.guess, second.topic)
        seen = _axes(second, log)
        joined = ", ".join(map(quoted, seen.paths))
        sign = f", sign = {_toml(seen.sign)}" if seen.sign else ""
        text += (
            f'# Second choice: kind = "{kind}", topic = {quoted(second.topic)}, '
            f"fields = [{joined}]{sign}  # {log.rate(second.topic)}\n"
        )
    return text


def _section(name: str, choice: Choice, log: Log, agreement: Agreement) -> str:
    guess, topic = choice.guess, choice.topic
    kind, of_kind = guesses.kind_of(guess, topic)
    seen = _axes(choice, log)
    paths, takes = seen.paths, guesses.measures(name, kind, len(seen.paths))
    usual = guess.unit.split()
    usual = usual * len(paths) if len(usual) == 1 else usual
    known = [log.unit(paths, at, topic, (takes[at],)) for at in range(len(paths))]
    found = _fields(name, kind, topic, paths, log)
    signs = seen.sign or (1.0,) * len(paths)
    drafted = scales(found, known, usual, signs, agreement)
    ordered = "CHECK: a set-point, not a measurement; " if words.is_set_point(topic) else ""
    lines = [f"[sensors.{name}]"]
    lines.append(f'kind = "{kind}"' + (f"  # {of_kind}" if of_kind else ""))
    doubt = f"{ordered}{_doubt(name, topic, paths)}"
    life = _idle(log.life(choice))
    lines.append(f"topic = {quoted(topic)}  # {doubt}{log.rate(topic)}{life}")
    joined = ", ".join(map(quoted, paths))
    named = f"fields = [{joined}]" if len(paths) > 1 else f"field = {joined}"
    lines.append(named + (f"  # {seen.check}" if seen.check and not seen.sign else ""))
    lines += [f"#   {in_comment(path)}: {log.values(topic, path)}" for path in paths]
    if name == "heading" and (blank := facts.unavailable(name, log.column(topic, choice.paths[0]))):
        lines.append(f"# CHECK: {blank}")
    check = f"  # {drafted.check}" if drafted.check else ""
    if len(set(drafted.units)) == 1:
        lines.append(f'unit = "{drafted.units[0]}"{check}')
    else:
        lines.append("units = [" + ", ".join(f'"{u}"' for u in drafted.units) + f"]{check}")
    signs = drafted.signs
    if any(sign != 1.0 for sign in signs):
        lines.append(
            f"sign = {_toml(signs)}  # {drafted.turned or seen.check or 'CHECK: its unit'}"
        )
    factor = 1.0
    if kind == "geodetic":
        numbers = [log.column(topic, path) for path in paths]
        factor, _ = facts.scale_of_coordinates(*numbers)
        lines += facts.of_coordinates(*numbers)
    if name in ("position", "velocity"):
        lines.append(stated.lever_arm(log.said(topic)) or LEVER_ARM)
    if name == "position":
        agreement.position(found, factor)
    elif name == "heading":
        agreement.heading(found, drafted.units[0], signs[0])
    accurate = accuracy.lines(name, kind, log.times(topic), _si(found, drafted, factor),
                              list(drafted.units))  # fmt: skip
    lines += stated.sigma(log.said(topic), accurate)
    return "\n".join(lines) + "\n"


def _fields(name: str, kind: str, topic: str, paths: Sequence[str], log: Log) -> Fields:
    time = log.times(topic)
    if not len(time):
        return Fields(name, kind, time * 1e-9, np.zeros((0, len(paths))))
    columns = [log.column(topic, path).fill_null(np.nan).to_numpy() for path in paths]
    whole = all(len(column) == len(time) for column in columns)
    raw = np.stack(columns, axis=1) if whole else np.full((len(time), len(paths)), np.nan)
    return Fields(name, kind, (time - time[0]) * 1e-9 + time[0] % 10**15 * 1e-9, raw)


def _si(found: Fields, drafted: Scales, factor: float) -> np.ndarray:
    """Values in SI, coordinates in deg."""
    if found.kind == "geodetic":
        return found.raw * factor
    return found.raw * np.array(
        [sign * units.factor(unit) for sign, unit in zip(drafted.signs, drafted.units, strict=True)]
    )


def _idle(life: int) -> str:
    return ("", "; CHECK: seldom sent", "; CHECK: it never changes")[life]


def _toml(signs: tuple[float, ...]) -> str:
    return str(signs[0] if len(signs) == 1 else list(signs))


def _axes(choice: Choice, log: Log) -> guesses.Axes:
    schema = log.contents.topics[choice.topic].schema
    return guesses.axes(choice.guess, choice.paths, choice.topic, schema)


def _doubt(name: str, topic: str, paths: Sequence[str]) -> str:
    """What the names of a sensor leave open, to stand before its other facts."""
    called = " ".join((topic, *paths))
    if name == "wind" and not words.is_apparent(called):
        return "CHECK: apparent wind, or true? "
    if name == "heading" and words.is_magnetic(called):
        return "CHECK: magnetic, off by the variation; "
    if name == "position" and re.search(r"(^|[._])x(_m)?$", paths[0], re.IGNORECASE):
        return "CHECK: x to the north, y to the east? "
    return ""


def _actuators(log: Log, used: set[str]) -> list[tuple[str, str, str, str]]:
    """Kind, topic, field and fallback unit of each: those that the recorder itself states, else by
    their names, and orders only of a kind that nobody measured."""
    if known := _stated(log):
        return known
    found: dict[str, tuple[str, str, str, str]] = {}
    for kind, _, _, fallback in ACTUATOR_TOPICS:
        for topic, columns in sorted(log.leaves.items()):
            path = guesses.drives(kind, topic, columns)
            if path and topic not in used:
                found.setdefault(topic, (kind, topic, path, fallback))
    log.look({topic: {path} for _, topic, path, _ in found.values()})
    chosen: list[tuple[str, str, str, str]] = []
    kinds: set[str] = set()
    for ordered in (False, True):
        for one in found.values():
            kind, topic, path, _ = one
            if words.is_set_point(topic) != ordered or not log.drives(topic, path):
                continue
            # The order of what is measured, as this or as the other of the two.
            other = {"thruster", "propeller"} if kind in ("thruster", "propeller") else {kind}
            if not ordered:
                kinds.add(kind)
            elif kinds & other:
                continue
            chosen.append(one)
    return chosen


def _stated(log: Log) -> list[tuple[str, str, str, str]]:
    """The actuators that the log itself says are some."""
    known = [
        (kind, topic, stated.field(columns), "1") for topic, columns in sorted(log.leaves.items())
        if (kind := stated.actuator(log.said(topic)))
    ]  # fmt: skip
    log.look({topic: {path} for _, topic, path, _ in known})
    return [one for one in known if log.drives(one[1], one[2])]


def _actuator(kind: str, topic: str, path: str, fallback: str, names: set[str], *, log: Log) -> str:
    unit = log.unit((path,), 0, topic, DRIVEN[kind])
    check = "" if unit else "  # CHECK: the log does not say"
    most = _largest(log.column(topic, path))
    if not unit and fallback == "1":
        fallback, size = particulars.unit_by_size(path, most)
        check += f"; {size}" if size else ""
    ordered = "CHECK: a set-point, what was ordered; " if words.is_set_point(topic) else ""
    said = log.said(topic)
    name = re.sub(r"\W+", "_", topic, flags=re.ASCII).strip("_").lower() or kind
    if name[:1].isdigit():
        name = f"{kind}_{name}"
    while name in names:  # topics that differ in other letters than a column's name has
        name += "_2"
    names.add(name)
    rest = (
        stated.actuator_lines(said, kind, unit or fallback, most) if stated.actuator(said)
        else particulars.of_actuator(kind, unit or fallback, most)
    )  # fmt: skip
    return (
        f'[[actuators]]\nname = "{name}"\nkind = "{kind}"\n'
        f"topic = {quoted(topic)}  # {ordered}{stated.comment(said)}{log.rate(topic)}\n"
        f'field = {quoted(path)}  # {log.values(topic, path)}\nunit = "{unit or fallback}"{check}\n'
        f"{log.describe_change(topic, path)}{rest}"
    )


def _largest(values: pl.Series) -> float | None:
    most = values.fill_nan(None).abs().max()
    return float(most) if isinstance(most, (int, float)) else None
