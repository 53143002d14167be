"""The known factors and angles, and the line of the profile that each of them asks for."""

from __future__ import annotations

import math

from shiplog.nomenclature import units
from shiplog.ship_profile.profile import Profile, Sensor
from shiplog.ship_profile.table_channels import TABLE_CHANNELS
from shiplog.ship_profile.units_of_channels import MEASURE

OTHER_UNITS = {  # factors to SI that loggers use and no profile names
    "speed": {"ft/s": 0.3048, "dm/s": 0.1},
    "rate of turn": {"rad/min": 1.0 / 60.0, "rev/s": 2.0 * math.pi, "mrad/s": 1e-3},
    "length": {"nautical miles": 1852.0},
    "angle": {"gon": math.pi / 200.0, "rev": 2.0 * math.pi},
}  # fmt: skip
NEAR = 0.02  # of a known factor: closer than that by its value
LEAST_APART = 0.08  # natural logarithm: two units nearer than that are not told apart


def sensor_of(profile: Profile, name: str) -> Sensor:
    return getattr(profile.sensors, name)


def declared(profile: Profile, name: str, index: int = 0) -> str:
    """The unit that the profile states for one field of a sensor; SI where it states none."""
    sensor = sensor_of(profile, name)
    given = sensor.units or ((sensor.unit,) * len(sensor.paths) if sensor.unit else ())
    if given:
        return given[index]
    channel = TABLE_CHANNELS[name, profile.sensors.kind(name)][index]
    return {"speed": "m/s", "length": "m", "angle": "rad", "rate of turn": "rad/s"}.get(
        MEASURE[channel], "1"
    )


def other_unit(
    profile: Profile, name: str, stored_over_true: float, low: float, high: float, index: int = 0
) -> str | None:
    """The unit that the values come in, where their ratio to what is true is that of two units."""
    unit = declared(profile, name, index)
    measure = units.measure(unit)
    if measure is None or stored_over_true <= 0:
        return None
    known = {one: units.TO_SI[one] for one in units.MEASURES[measure]} | OTHER_UNITS.get(
        measure, {}
    )
    wanted = units.factor(unit) / stored_over_true
    found = min(known, key=lambda one: abs(math.log(known[one] / wanted)))
    off = math.log(known[found] / wanted)
    wide = 0.5 * abs(math.log(high / low)) if 0 < low < high else 0.0
    same = abs(math.log(known[found] / units.factor(unit))) < LEAST_APART
    return None if same or abs(off) > max(NEAR, min(wide, 0.2)) else found


def converted_twice(
    profile: Profile, name: str, stored_over_true: float, low: float, high: float, index: int = 0
) -> str | None:
    """A factor on the channel, where the ratio is that of two units other than the profile's: the
    recorder converted what was converted already, or the wrong way."""
    measure = units.measure(declared(profile, name, index))
    if measure is None or stored_over_true <= 0:
        return None
    known = {one: units.TO_SI[one] for one in units.MEASURES[measure]} | OTHER_UNITS.get(
        measure, {}
    )
    wide = min(0.5 * abs(math.log(high / low)), 0.05) if 0 < low < high else 0.0
    pairs = [
        (abs(math.log(known[a] / known[b] / stored_over_true)), a, b)
        for a in known for b in known if abs(math.log(known[a] / known[b])) > LEAST_APART
    ]  # fmt: skip
    off, a, b = min(pairs)
    if off > max(0.5 * NEAR, wide):
        return None
    sensor = sensor_of(profile, name)
    others = sensor.sign[index] if isinstance(sensor.sign, tuple) else sensor.sign
    text = f"{others / stored_over_true:.4g}"
    factor = text if _alike(profile, name) else _each(sensor, index, text, "1.0")
    return f"sign = {factor} on [sensors.{name}], the factor between {a} and {b}"


def unit_line(profile: Profile, name: str, unit: str, index: int = 0) -> str:
    """The key and its value, such as `units = ["kn", "deg"] on [sensors.velocity]`."""
    sensor = sensor_of(profile, name)
    place = f"on [sensors.{name}]"
    if unit not in units.TO_SI:
        measure = units.measure(declared(profile, name, index)) or ""
        ratio = OTHER_UNITS[measure][unit] / units.factor(declared(profile, name, index))
        return f"sign = {_each(sensor, index, f'{ratio:.4g}', '1.0')} {place}"
    if len(sensor.paths) == 1:
        return f'unit = "{unit}" {place}'
    listed = [declared(profile, name, i) for i in range(len(sensor.paths))]
    both = _alike(profile, name)
    listed = [unit if both or i == index else one for i, one in enumerate(listed)]
    if len(set(listed)) == 1:
        return f'unit = "{unit}" {place}'
    quoted = ", ".join(f'"{one}"' for one in listed)
    return f"units = [{quoted}] {place}"


def _alike(profile: Profile, name: str) -> bool:
    """Whether all fields of a sensor have one unit: not of a speed and its direction."""
    return profile.sensors.kind(name) not in ("sog_cog", "from_bow")


def _each(sensor: Sensor, index: int, value: str, others: str) -> str:
    if len(sensor.paths) == 1:
        return value
    return f"[{', '.join(value if i == index else others for i in range(len(sensor.paths)))}]"


def sign_line(profile: Profile, name: str, index: int | None = None) -> str:
    """`sign = -1.0 on [sensors.yaw_rate]`; of one field of several with `index`. A sign that the
    profile states already is turned round."""
    sensor = sensor_of(profile, name)
    signs = sensor.sign if isinstance(sensor.sign, tuple) else (sensor.sign,) * len(sensor.paths)
    turned = [-one if index is None or i == index else one for i, one in enumerate(signs)]
    if len(set(turned)) == 1:
        return f"sign = {turned[0]:.4g} on [sensors.{name}]".replace("= -1 ", "= -1.0 ").replace(
            "= 1 ", "= 1.0 "
        )
    text = ", ".join(f"{one:.1f}" if abs(one) == 1 else f"{one:g}" for one in turned)
    return f"sign = [{text}] on [sensors.{name}]"


def offset_line(profile: Profile, name: str, degrees: float, index: int | None = None) -> str:
    """`offset = [0.0, 20.0] on [sensors.velocity]`: the raw value that stands for zero, where the
    channel as it is read stands `degrees` further on than it should. An offset and a sign that the
    profile states already are part of it: with v = s (w - o), v - d = s (w - o - d/s)."""
    sensor, at = sensor_of(profile, name), index or 0
    offsets, signs = (
        one if isinstance(one, tuple) else (one,) * len(sensor.paths)
        for one in (sensor.offset, sensor.sign)
    )
    turn = 2.0 * math.pi if declared(profile, name, at) == "rad" else 360.0
    found = offsets[at] + degrees * turn / 360.0 / signs[at]
    found -= turn * math.ceil(found / turn - 0.5)
    texts = [f"{found + 0.0:.4g}" if i == at else f"{one:.1f}" for i, one in enumerate(offsets)]
    text = f"[{', '.join(texts)}]" if len(texts) > 1 else texts[0]
    return f"offset = {text} on [sensors.{name}]"


def times(value: float) -> str:
    """A ratio in four digits."""
    return f"{value:.4g}" if value < 1000 else f"{value:.0f}"


def words(name: str) -> str:
    return name.replace("_", " ")
