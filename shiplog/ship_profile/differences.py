"""Where two profiles of one ship differ in what a voyage's table or a model is made of.

Names of files, [table], topics, accuracies and lines to check are of no consequence for a stored
voyage. Sizes, places, lever arms and kinds of sensors are: one model is of one ship.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from shiplog.ship_profile.profile import Actuator, Profile, Source

SIZES = (
    "length_m", "breadth_m", "draught_m", "mass_kg", "x_g_m", "block_coefficient",
    "frontal_area_m2", "lateral_area_m2",
)  # fmt: skip
OF_ACTUATORS = ("kind", "position_m", "direction_deg", "diameter_m", "area_m2", "span_m")
SAME = 1e-6  # share of a number: a text of it has no more digits

Value = float | str | tuple[float, float] | None


def differences(one: Profile, other: Profile) -> tuple[str, ...]:
    """Keys with both values, such as `ship.length_m (3 and 3.3)`. What only one of them states is
    no difference: an estimate stood in for it."""
    return tuple(
        f"{key} ({_text(a)} and {_text(b)})"
        for key, a, b in _compared(one, other)
        if a is not None and b is not None and not _alike(a, b)
    )


def readings(one: Profile, other: Profile) -> tuple[str, ...]:
    """Keys of sensors and actuators that both profiles read from the same fields, with another
    unit, sign or zero, or for another one of its kind: one of the two may be wrong."""
    mine = _sources(one)
    kept: dict[tuple, set[str]] = {}
    for key, source in mine.items():
        kept.setdefault(_fields(source), set()).add(key)
    found = []
    for key, source in _sources(other).items():
        if key not in mine:
            continue
        same = _fields(mine[key]) == _fields(source)
        scaled = same and mine[key].scale() != source.scale()
        if scaled or key not in kept.get(_fields(source), {key}):
            found.append(key)
    return tuple(found)


def _fields(source: Source) -> tuple:
    return source.topic, tuple(source.paths)


def _compared(one: Profile, other: Profile) -> Iterator[tuple[str, Value, Value]]:
    for name in SIZES:
        yield f"ship.{name}", getattr(one.ship, name), getattr(other.ship, name)
    mine, theirs = dict(one.sensors.items()), dict(other.sensors.items())
    for name in mine:
        if name in theirs:
            yield f"sensors.{name}.kind", one.sensors.kind(name), other.sensors.kind(name)
            yield (
                f"sensors.{name}.lever_arm_m", mine[name].lever_arm_m, theirs[name].lever_arm_m
            )  # fmt: skip
    by = {actuator.name: actuator for actuator in other.actuators}
    for actuator in one.actuators:
        if actuator.name not in by:
            continue
        for key in OF_ACTUATORS:
            values = getattr(actuator, key), getattr(by[actuator.name], key)
            yield f"actuators.{actuator.name}.{key}", *values
        if actuator.kind == "thruster":  # its command counts as a share of full thrust
            full = _full(actuator), _full(by[actuator.name])
            yield f"actuators.{actuator.name}.limits", *full


def _full(actuator: Actuator) -> float | None:
    """The command at full thrust, in SI."""
    if actuator.limits is None:
        return None
    offset, factor = actuator.scale()[0]
    return max(abs((limit - offset) * factor) for limit in actuator.limits)


def _sources(profile: Profile) -> dict:
    return {f"sensors.{name}": sensor for name, sensor in profile.sensors.items()} | {
        f"actuators.{actuator.name}": actuator for actuator in profile.actuators
    }


def _alike(a: Value, b: Value) -> bool:
    if isinstance(a, tuple) and isinstance(b, tuple):
        return all(_alike(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, float | int) and isinstance(b, float | int):
        return math.isclose(a, b, rel_tol=SAME, abs_tol=SAME)
    return a == b


def _text(value: Value) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(f'{number:g}' for number in value)}]"
    return f"{value:g}" if isinstance(value, float | int) else str(value)
