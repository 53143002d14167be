"""The columns of a table that hold what drives the ship."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

import polars as pl

from shiplog.drafting import facts, particulars, words
from shiplog.drafting.column_names import UNIT_UNSTATED, FoundColumn, measured, with_doubts
from shiplog.logs.conversion.delimited import DelimitedTable
from shiplog.nomenclature import units
from shiplog.ship_profile.units_of_channels import DRIVEN

_SIDES = {
    "port", "stbd", "starboard", "sb", "bb", "ps", "left", "right", "fore", "aft", "bow", "stern",
    "main", "mid", "centre", "center", "fwd", "inner", "outer", "upper", "lower", "a", "b", "c",
    "l", "p", "r", "s"
}  # fmt: skip
_STATES = {
    "act", "actual", "feedback", "fb", "meas", "measured", "raw", "resp", "response", "value",
    "indicated", "sensor", "cmd", "command", "commanded", "order", "ordered", "set", "point",
    "setpoint", "sp", "ref", "reference", "des", "desired", "target", "pct", "percent"
}  # fmt: skip
_TURNS = _SIDES | _STATES | {"angle", "pos", "position", "deflection", "deg", "rad", "pwm", "us"}
_SPINS = _SIDES | _STATES | {"speed", "rpm", "rps", "n", "rev", "revs"}
_COMMANDS = _SPINS | {"pwm", "us", "out", "output", "lever", "level"}
ACTUATOR_COLUMNS = {  # kind: its names, words that may follow them, the unit where none is stated
    "azimuth": ({"azimuth", "azipod", "azi", "pod"},
                _TURNS | {"thruster", "rpm", "rps", "speed"}, "deg"),
    "rudder": ({"rudder", "rudders", "rud", "ruds", "steering", "delta"}, _TURNS, "deg"),
    "propeller": ({"rpm", "rps", "propeller", "propellers", "prop", "props", "shaft", "shafts",
                   "rev", "revs", "revolutions", "engine"}, _SPINS, "rps"),
    "thruster": ({"thr", "thrust", "thruster", "thrusters", "throttle", "pwm", "motor", "motors",
                  "esc", "escs", "servo", "servos"}, _COMMANDS, "1"),
}  # fmt: skip
_FIRST = frozenset({"delta"})  # of a rudder where it begins the name, else a difference
_BARE = {"propeller": ("n", "speed")}  # names where no other word comes first
_LONG = 3  # letters of a name that a further word may follow without a gap: `thrleft`
_THRUSTER = re.compile(r"thr|motor|esc|servo|pwm")
_NO_ACTUATION = re.compile(
    r"thrust_n|torque|force|power|current|voltage|temp|zero|neutral|_kw|load|pitch|fuel|press"
)
# A shaft's order and a thruster's measure are of one kind: what drives the ship ahead.
DRIVING = {kind: {"propeller", "thruster"} for kind in ("propeller", "thruster")}
TWINS = 0.99999  # correlation of two columns that hold one value twice
PULSES_US = (800.0, 2200.0)  # a servo's pulses, neutral in the middle
NEUTRAL_US = 1500.0
GEARED = "of the engine: its propeller may turn more slowly"


def found_actuators(
    rows: pl.DataFrame, table: DelimitedTable, taken: set[str]
) -> tuple[list[tuple[str, FoundColumn]], list[str]]:
    """(kind, column) of each: measured ones, and orders only of a kind that nothing measured; and
    the columns that are called so and never move."""
    idle: list[str] = []
    actuators: list[tuple[str, FoundColumn]] = []
    taken, names = set(taken), set()
    for ordered in (False, True):
        kinds = {kind for kind, _ in actuators}
        for kind, one in _called_so(rows, table, ordered):
            if one.column in taken or (ordered and kinds & DRIVING.get(kind, {kind})):
                continue
            if _never_moves("thruster" if ordered else kind, rows[one.column]):
                idle.append(one.column)
                continue
            taken.add(one.column)
            alike = [other.column for k, other in actuators if k == kind]
            if any(_twins(rows, one.column, other) for other in alike):
                continue
            if one.doubts[-1:] == (GEARED,) and kind in {k for k, _ in actuators}:
                continue
            name = _free_name(kind, one.column, names)
            names.add(name)
            actuators.append((kind, _pulsed(replace(one, channel=name), rows)))
    return actuators, idle


def _never_moves(kind: str, values: pl.Series) -> bool:
    """Whether a column is 0 throughout, or a thruster's or an order is one value: the number of an
    output, or one that nothing is connected to. A shaft may turn evenly for a whole record."""
    numbers = values.cast(pl.Float64).fill_nan(None).drop_nulls()
    if len(numbers) < facts.FEW or numbers.n_unique() > 1:
        return False
    return kind == "thruster" or numbers[0] == 0.0


def _called_so(
    rows: pl.DataFrame, table: DelimitedTable, ordered: bool
) -> Iterator[tuple[str, FoundColumn]]:
    """Every column that is called as an actuator, kind by kind, engines last of theirs."""
    for kind, (_, _, default) in ACTUATOR_COLUMNS.items():
        found = []
        for column in rows.columns:
            values = rows[column]
            if not values.dtype.is_numeric() or not facts.holds("", values):
                continue
            if words.is_derived(column) or words.is_set_point(column) != ordered:
                continue
            if not _NO_ACTUATION.search(column.lower()) and _is_called(kind, column):
                found.append(_driving(kind, values, default, table))
        known = [one for one in found if one is not None]
        yield from sorted(known, key=lambda one: one[1].doubts[-1:] == (GEARED,))


def _is_called(kind: str, column: str) -> bool:
    """Whether a column's name is that of an actuator, with nothing after it but which and what."""
    names, follow, _ = ACTUATOR_COLUMNS[kind]
    parts = re.findall(r"[a-z]+|\d+", words.parted(words.without_unit(column)))
    for at, part in enumerate(parts):
        joined = any(
            part.startswith(n) and part[len(n) :] in follow for n in names if len(n) >= _LONG
        )
        if (part in names or joined) and not (part in _FIRST and at > 0):
            return all(p in follow or p in names or p.isdigit() for p in parts[at + 1 :])
    bare = parts[:1] and parts[0] in _BARE.get(kind, ())
    return bool(bare) and all(p in _SPINS or p.isdigit() for p in parts[1:])


def _driving(
    kind: str, values: pl.Series, default: str, table: DelimitedTable
) -> tuple[str, FoundColumn] | None:
    """A column as an actuator of this kind, or of the one that its unit says; None for neither."""
    called = words.parted(words.without_unit(values.name))
    if kind == "azimuth":  # a unit that turns has an angle and a propeller
        spun = measured(values, "", "rpm", ("shaft speed",), table)
        if spun and spun.unit_stated:
            return "thruster", spun
        one = measured(values, "", default, DRIVEN[kind], table)
        return (kind, one) if one and "speed" not in called else None
    if kind == "propeller" and _THRUSTER.search(called):
        return None  # a thruster's speed
    one = measured(values, "", default, DRIVEN[kind], table)
    if one is None:
        return None
    engine = "engine" in called or words.bare(values.name) == "speed"
    if kind == "propeller" and engine:
        spins = one.unit_stated and units.measure(one.unit or "") == "shaft speed"
        return (kind, with_doubts(one, GEARED)) if spins else None
    if kind == "rudder" and one.unit and units.measure(one.unit) != "angle":
        return kind, with_doubts(one, "no angle; `sign` can turn it into rad")
    return kind, one


def _free_name(kind: str, column: str, names: set[str]) -> str:
    name = re.sub(r"\W+", "_", words.bare(column)) or kind
    name = f"{kind}_{name}" if name[:1].isdigit() or len(name) < 2 else name
    while name in names:
        name += "_2"
    return name


def _twins(rows: pl.DataFrame, one: str, other: str) -> bool:
    """Whether two columns are the same value in two units or signs."""
    alike = rows.select(pl.corr(pl.col(one).cast(pl.Float64), pl.col(other).cast(pl.Float64)))
    return abs(alike.item() or 0.0) > TWINS


def _pulsed(one: FoundColumn, rows: pl.DataFrame) -> FoundColumn:
    """An actuator that is given in servo pulses: their neutral is no command."""
    if one.unit != "pwm" and (one.unit != "1" or one.unit_stated):
        return one
    values = rows[one.column].cast(pl.Float64).fill_nan(None).drop_nulls()
    if bool(values.is_between(*PULSES_US).all()):
        doubts = tuple(doubt for doubt in one.doubts if doubt != UNIT_UNSTATED)
        return replace(one, unit="pwm", offset=NEUTRAL_US, doubts=doubts, why="the neutral pulse")
    if one.unit == "pwm":
        return with_doubts(one, "no pulses of a servo in µs")
    most = values.abs().max()
    unit, size = particulars.unit_by_size(one.column, most if isinstance(most, float) else None)
    return with_doubts(replace(one, unit=unit), size) if size else one
