"""A trial sheet: the numbers that were measured of standard manoeuvres, each with its spread, and
the conditions in which they were. A TOML:

    profile = "kvlcc2-full-scale"     # or a path from the sheet's folder; --profile is another way
    source = "sea trials of 12 May 2019"

    [conditions]                      # of all manoeuvres; each may have a [manoeuvre.conditions]
    speed = 7.97                      # approach, m/s
    revolutions = 1.6                 # of the propellers, rev/s
    wind = [3.0, 40.0]                # m/s, and deg that it comes from, off the approach's heading
    rudder_rate = 2.34                # deg/s

    [[manoeuvre]]
    kind = "turn"                     # turn, zigzag, stop or pull_out
    angle = 35                        # of the rudder, deg to starboard
    advance = { value = 3.02, spread = 0.06 }
    tactical_diameter = { value = 981, spread = 20, unit = "m" }

`spread` is the standard deviation of the value. Quantities, their names and units are those of
`manoeuvres --json`; a length may be in m instead of L.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shiplog.exceptions import ShiplogError, listed, nearest
from shiplog.manoeuvres.quantity import QUANTITIES
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.sailing import from_direction
from shiplog.simulation.schedules import PULL_OUT_ANGLE, PullOut, Stop, Turn, Zigzag

KINDS: dict[str, tuple[str, ...]] = {  # what is measured of each, and so what a sheet may state
    "turn": ("advance", "transfer", "tactical_diameter", "steady_diameter", "drift_angle",
             "speed_loss"),
    "zigzag": ("initial_turning", "first_overshoot", "second_overshoot", "third_overshoot",
               "check_time", "period"),
    "stop": ("track_reach", "head_reach", "lateral_deviation"),
    "pull_out": ("residual_yaw_rate",),
}  # fmt: skip
# For how long each is sailed: until the last number that the sheet states of it.
STEADY_TURN = {"steady_diameter", "drift_angle", "speed_loss"}
SHORT_TURN, LONG_TURN = math.radians(190.0), math.radians(560.0)
REVERSALS = {"second_overshoot": 3, "third_overshoot": 4, "period": 4}  # of the rudder; else 2
CONDITIONS = ("speed", "revolutions", "wind", "rudder_rate")
MOST_BYTES = 1_000_000  # of a sheet, which has a page of numbers
HELP = "the manual's page on trial sheets has an example"


class SheetError(ShiplogError):
    """A trial sheet that cannot be used as it is."""


@dataclass(frozen=True, slots=True)
class Stated:
    """One number of the sheet, in the unit of its quantity; `spread` is its standard deviation."""

    name: str
    value: float
    spread: float


@dataclass(frozen=True)
class SheetManoeuvre:
    """One manoeuvre of the sheet, as it is sailed.

    speed         of the approach, m/s
    revolutions   of the propellers, rev/s; None where it is not stated
    wind          [2] where it comes from along the approach's heading and to starboard, m/s
    rudder_rate   rad/s; 0 where it is not stated
    """

    manoeuvre: Turn | Zigzag | Stop | PullOut
    stated: tuple[Stated, ...]
    speed: float
    revolutions: float | None
    wind: tuple[float, float]
    rudder_rate: float

    @property
    def name(self) -> str:
        return self.manoeuvre.name


@dataclass(frozen=True)
class TrialSheet:
    """path      of the file
    profile   that it names; empty where it names none
    """

    path: Path
    source: str
    profile: str
    manoeuvres: tuple[SheetManoeuvre, ...]

    @property
    def numbers(self) -> int:
        return sum(len(one.stated) for one in self.manoeuvres)


def read(path: Path, length: float | None = None) -> TrialSheet:
    """A sheet of a ship of that length [m], which is only asked for where a length is in m.

    Raises SheetError.
    """
    content = _toml(path)
    top = content.get("conditions", {})
    _refuse_other(path, "the sheet", content, ("profile", "source", "conditions", "manoeuvre"))
    each = content.get("manoeuvre")
    if not isinstance(each, list) or not each or not all(isinstance(m, dict) for m in each):
        raise SheetError(
            f"The trial sheet {path} has no [[manoeuvre]].",
            hint=f"add one with its kind and numbers; {HELP}.",
        )
    found = tuple(_manoeuvre(path, i, m, top, length) for i, m in enumerate(each, 1))
    return TrialSheet(
        path, str(content.get("source", path.name)), str(content.get("profile", "")), found
    )


def profile_of(path: Path) -> str:
    """The profile that a sheet names, as a name or a path from here; empty where it names none.
    Raises SheetError."""
    named = _toml(path).get("profile", "")
    if not isinstance(named, str):
        raise SheetError(f"The trial sheet {path}: profile is no text.", hint="name a profile.")
    beside = path.parent / named
    return str(beside) if named.endswith(".toml") else named


def ship_of(path: Path, chosen: str | None) -> Profile:
    """The ship of a sheet: the profile that was chosen, else the one it names. Raises SheetError,
    where nothing names one, or ProfileError."""
    name = chosen or profile_of(path)
    if not name:
        raise SheetError(
            f"The trial sheet {path} names no profile of the ship.",
            hint='add profile = "NAME or PATH" to it, or give --profile.',
        )
    ship = profiles.load(name)
    ship.require_actuators()
    return ship


def _toml(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > MOST_BYTES:
            raise SheetError(
                f"{path} has {path.stat().st_size} bytes, which no trial sheet has.",
                hint="give the TOML of the sheet.",
            )
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SheetError(
            f"The trial sheet {path} cannot be read: {error.strerror}.",
            hint="give --trial-sheet the path of its TOML.",
        ) from error
    except (ValueError, RecursionError) as error:
        raise SheetError(
            f"The trial sheet {path} is not valid TOML: {error}.", hint="mend that line."
        ) from error


def _manoeuvre(
    path: Path, number: int, content: Mapping[str, Any], top: object, length: float | None
) -> SheetManoeuvre:
    where = f"manoeuvre {number}"
    kind = content.get("kind")
    if kind not in KINDS:
        raise SheetError(
            f"{path}, {where}: kind is {kind!r}{nearest(str(kind), KINDS)}.",
            hint=f"it can be {listed(KINDS)}.",
        )
    _refuse_other(
        path, f"{where} ({kind})", content, ("kind", "angle", "heading", "conditions", *KINDS[kind])
    )
    conditions = _conditions(path, where, top, content.get("conditions", {}))
    stated = tuple(
        _stated(path, where, name, content[name], length) for name in KINDS[kind] if name in content
    )
    if not stated:
        raise SheetError(
            f"{path}, {where} ({kind}) states no number.",
            hint=f"it can have {listed(KINDS[kind])}, each with value and spread.",
        )
    names = {one.name for one in stated}
    return SheetManoeuvre(_sailed(path, where, kind, content, names), stated, *conditions)


def _sailed(
    path: Path, where: str, kind: str, content: Mapping[str, Any], names: set[str]
) -> Turn | Zigzag | Stop | PullOut:
    if kind == "stop":
        return Stop()
    angle = _number(path, where, "angle", content.get("angle",
                    PULL_OUT_ANGLE if kind == "pull_out" else None))  # fmt: skip
    if not 0.0 < abs(angle) <= 90.0:
        raise SheetError(
            f"{path}, {where}: a rudder angle of {angle:g} deg turns no ship.",
            hint="give degrees such as 35, or -35 to port.",
        )
    if kind == "turn":
        brief = not names & STEADY_TURN
        return Turn(math.radians(angle), by=SHORT_TURN if brief else LONG_TURN)
    if kind == "pull_out":
        return PullOut(math.radians(angle))
    heading = _number(path, where, "heading", content.get("heading", abs(angle)))
    if not 0.0 < heading <= 180.0:
        raise SheetError(
            f"{path}, {where}: a zigzag to a heading of {heading:g} deg is none.",
            hint="give degrees such as 10.",
        )
    reversals = max(REVERSALS.get(name, 2) for name in names)
    return Zigzag(math.radians(angle), math.radians(heading), reversals)


def _stated(path: Path, where: str, name: str, given: object, length: float | None) -> Stated:
    if not isinstance(given, Mapping) or not {"value", "spread"} <= set(given):
        raise SheetError(
            f"{path}, {where}: {name} is {given!r}, without value and spread.",
            hint=f"write it as {name} = {{ value = 3.0, spread = 0.1 }}; the spread is the "
            "standard deviation of the value.",
        )
    _refuse_other(path, f"{where}, {name}", given, ("value", "spread", "unit"))
    value, spread = (_number(path, where, f"{name}.{k}", given[k]) for k in ("value", "spread"))
    if spread <= 0.0:
        raise SheetError(
            f"{path}, {where}: the spread of {name} is {spread:g}.",
            hint="give its standard deviation, above zero: of repeated trials, or how well it was "
            "read off.",
        )
    unit = QUANTITIES[name].unit
    factor = 1.0
    if (own := given.get("unit", unit)) != unit:
        if (unit, own) != ("L", "m") or length is None:
            raise SheetError(
                f"{path}, {where}: {name} is in {own!r}.",
                hint=f"give it in {unit}{' or m' if unit == 'L' else ''}.",
            )
        factor = 1.0 / length
    return Stated(name, factor * value, factor * spread)


def _conditions(
    path: Path, where: str, top: object, own: object
) -> tuple[float, float | None, tuple[float, float], float]:
    """speed, revolutions, wind, rudder_rate."""
    for given in (top, own):
        if not isinstance(given, Mapping):
            raise SheetError(f"{path}, {where}: conditions is no section.", hint=f"{HELP}.")
        _refuse_other(path, f"{where}, conditions", given, CONDITIONS)
    both: dict[str, Any] = {**top, **own}  # type: ignore[dict-item]  # both are mappings
    if "speed" not in both:
        raise SheetError(
            f"{path}, {where} has no approach speed.",
            hint="add speed (m/s) to [conditions]: every quantity depends on it.",
        )
    speed = _number(path, where, "speed", both["speed"])
    if speed <= 0.0:
        raise SheetError(
            f"{path}, {where}: an approach speed of {speed:g} m/s.", hint="give m/s ahead."
        )
    revolutions = None
    if "revolutions" in both:
        revolutions = _number(path, where, "revolutions", both["revolutions"])
    wind = both.get("wind", [0.0, 0.0])
    if not isinstance(wind, list) or len(wind) != 2:
        raise SheetError(
            f"{path}, {where}: wind is {wind!r}.",
            hint="give [m/s, deg that it comes from, off the approach's heading].",
        )
    blowing = from_direction(*(_number(path, where, "wind", one) for one in wind))
    rate = math.radians(_number(path, where, "rudder_rate", both.get("rudder_rate", 0.0)))
    return speed, revolutions, blowing, rate


def _number(path: Path, where: str, name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not _finite(value):
        raise SheetError(f"{path}, {where}: {name} is {value!r}.", hint="give it a number.")
    return float(value)


def _finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer of hundreds of digits
        return False


def _refuse_other(path: Path, where: str, given: Mapping[str, Any], known: tuple[str, ...]) -> None:
    for name in given:
        if name not in known:
            raise SheetError(
                f"{path}, {where}: there is no {name!r}{nearest(name, known)}.",
                hint=f"it can have {listed(known, most=20)}.",
            )
