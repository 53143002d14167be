"""Which variables of an FMU are which channels: a TOML, drafted from the model description.

    [simulator]
    step_s = 0.1                     # communication step
    between = "straight"             # two seconds, inputs go so; or "hold": as the first has them

    [state.surge]
    output = "u"                     # what it gives
    start = "u_start"                # what a window begins with
    unit = "kn"

    [inputs.rudder]                  # an actuator of the profile, or the wind
    variable = "delta"
    start = "delta_start"            # where it stands when a window begins, if there is such
    unit = "deg"
    sign = -1                        # where the variable counts the other way

    [parameters]                     # what is set before every start
    use_table = true

The wind comes as `wind_speed` and `wind_angle`, apparent at midship; as `wind_x0` and `wind_y0`,
where the true wind comes from along these axes; or as `true_wind_speed` and `true_wind_direction`.
`variable = "-"` says that the FMU has no such input.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shiplog.exceptions import ProfileError, UnreadableError, listed, nearest
from shiplog.foreign.source import SimulatorError
from shiplog.nomenclature import units
from shiplog.ship_profile.profile import Profile
from shiplog.ship_profile.unchecked_lines import unchecked_lines

STEP_S = 0.1  # s: a tenth of the rows; a ship of metres turns in seconds
BETWEEN = ("straight", "hold")
NONE = "-"  # instead of a variable that there is none of
# What a channel measures, the unit that shiplog has it in, and names under which it goes, without
# what is no letter or digit
STATE = {
    "x0": ("length", "m", ("x0", "x", "north", "northing", "posnorth", "positionnorth", "n")),
    "surge": ("speed", "m/s", ("surge", "u", "surgevelocity", "surgespeed", "ub", "vx")),
    "y0": ("length", "m", ("y0", "y", "east", "easting", "poseast", "positioneast", "e")),
    "sway": ("speed", "m/s", ("sway", "v", "swayvelocity", "swayspeed", "vm", "vb", "vy")),
    "heading": ("angle", "rad", ("heading", "psi", "yaw", "yawangle", "course", "hdg")),
    "yaw_rate": ("rate of turn", "rad/s", ("yawrate", "r", "rateofturn", "rot", "yawvelocity")),
}
NEEDED = ("surge", "sway", "heading", "yaw_rate")
RESTARTED = ("surge", "sway", "yaw_rate")
WIND = {
    "wind_speed": ("speed", "m/s", ("windspeed", "apparentwindspeed", "relativewindspeed", "aws")),
    "wind_angle": (
        "angle", "rad", ("windangle", "apparentwindangle", "relativewindangle", "awa"),
    ),
    "wind_x0": ("speed", "m/s", ("windx0", "windnorth", "windx")),
    "wind_y0": ("speed", "m/s", ("windy0", "windeast", "windy")),
    "true_wind_speed": ("speed", "m/s", ("truewindspeed", "tws")),
    "true_wind_direction": (
        "angle", "rad", ("truewinddirection", "winddirection", "twd", "truewindangle"),
    ),
}  # fmt: skip
BEGINS = ("start", "start{}", "{}start", "initial{}", "{}initial", "init{}", "{}init", "{}0", "0{}")
SHAFT = {"rad/s": 1.0 / 6.283185307179586, "1/min": 1.0 / 60.0, "Hz": 1.0, "1/s": 1.0}
SPELLED = {"m.s-1": "m/s", "m s-1": "m/s", "rad.s-1": "rad/s", "degree": "deg", "degrees": "deg",
           "radian": "rad", "knot": "kn", "°": "deg", "r/min": "rpm", "1/min": "rpm"}  # fmt: skip


@dataclass(frozen=True)
class Variable:
    """A variable of a model description.

    causality   "input", "output", "parameter", "local", ...
    settable    whether it may be set before the simulation starts
    kind        "real", "boolean" or "integer"
    """

    name: str
    causality: str
    settable: bool
    kind: str
    unit: str
    description: str


@dataclass(frozen=True)
class Description:
    """What an FMU says of itself."""

    name: str
    version: str
    tool: str
    step: float
    variables: tuple[Variable, ...]
    exchange: bool = False  # for model exchange, and not for co-simulation

    @classmethod
    def from_record(cls, facts: Mapping[str, Any]) -> Description:
        variables = tuple(Variable(**one) for one in facts["variables"])
        return cls(
            facts["name"], facts["version"], facts["tool"], facts["step"], variables,
            facts["exchange"],
        )  # fmt: skip

    def named(self, names: Iterable[str], *causalities: str) -> Variable | None:
        """The first variable that goes under one of these names."""
        wanted = [_plain(one) for one in names]
        of = [v for v in self.variables if v.kind == "real" and v.causality in causalities]
        for name in wanted:
            for one in of:
                if _plain(one.name) == name or _plain(one.name.rpartition(".")[2]) == name:
                    return one
        return None


def draft(of: Description, profile: Profile) -> str:
    """A mapping's TOML; what it is not sure of says CHECK."""
    step = of.step or STEP_S
    has_step = bool(of.step) or of.exchange  # which takes no steps
    lines = [
        f"# Which variables of {_comment(of.name)} (FMI {_comment(of.version)}) are which channels "
        "of the ship.",
        "# Drafted by shiplog: look at every line that says CHECK, and take the CHECK away.",
        "", "[simulator]",
        f"step_s = {step:g}" + ("" if has_step else "  # CHECK communication step"),
    ]  # fmt: skip
    if of.tool.startswith("shiplog"):  # its coefficients were fitted to inputs that are held
        lines.append('between = "hold"')
    for channel, (_, unit, names) in STATE.items():
        output = of.named((channel, *names), "output") or of.named((channel, *names), "local")
        start = _start(of, (channel, *names), output)
        if output is None and channel not in NEEDED:
            continue
        lines += ["", f"[state.{channel}]", _line("output", output)]
        if (start is not None or channel in RESTARTED) and not of.exchange:
            lines.append(_line("start", start))
        lines.append(_unit(output or start, unit))
    for actuator in profile.actuators:
        names = (actuator.name, f"order.{actuator.name}", actuator.name.replace("_", ""))
        found = of.named(names, "input") or _only(of, actuator.kind, profile)
        lines += ["", f"[inputs.{actuator.name}]", _line("variable", found)]
        begin = _start(of, (actuator.name,), None)
        lines += [] if begin is None else [_line("start", begin)]
        lines.append(_unit(found, actuator.si_unit))
    for channel, (_, unit, names) in WIND.items():
        found = of.named((channel, *names), "input")
        if found is not None:
            lines += ["", f"[inputs.{channel}]", _line("variable", found), _unit(found, unit)]
    fixed = [v for v in of.variables if v.kind == "boolean" and v.settable]
    if of.tool.startswith("shiplog") and any(v.name == "recorded" for v in fixed):
        lines += ["", "[parameters]", "recorded = true"]
    return "\n".join([*lines, ""])


def load(path: Path, of: Description, profile: Profile, unchecked: bool) -> dict[str, Any]:
    """The mapping as a child takes it, with factors to SI. Raises SimulatorError."""
    try:
        text = path.read_text(encoding="utf-8")
        content = tomllib.loads(text)
    except (OSError, ValueError, RecursionError) as error:
        raise UnreadableError(f"{path} is not valid TOML: {error}.", hint="mend it.") from error
    doubts = () if unchecked else unchecked_lines(text)
    if doubts:
        raise SimulatorError(
            f"{path} still says CHECK: {listed(doubts, most=6)}.",
            hint="look at these lines and take the CHECK away, or give --unchecked.",
        )
    try:
        return _resolved(content, of, profile, str(path))
    except (AttributeError, TypeError, ValueError) as error:
        raise SimulatorError(f"{path} cannot be used: {error}.", hint="mend it.") from error


def _resolved(
    content: Mapping[str, Any], of: Description, profile: Profile, path: str
) -> dict[str, Any]:
    known = {v.name: v for v in of.variables}

    def named(name: Any, where: str) -> str:
        if name not in known:
            raise SimulatorError(
                f"{path}: {where} = {str(name)!r}, and {of.name} has no such variable"
                f"{nearest(str(name), known)}.",
                hint="correct the name; "
                + (f"it has {listed(known, most=12)}." if known else "it has no variables."),
            )
        return str(name)

    states = {}
    for channel in STATE:
        given = content.get("state", {}).get(channel)
        if given is None:
            if channel in NEEDED:
                raise _lacks(path, of, f"state.{channel}", "what the FMU gives of it")
            continue
        measure, _, _ = STATE[channel]
        factor = _factor(given, measure, f"{path}: state.{channel}")
        start = given.get("start", NONE)
        if start == NONE and channel in RESTARTED and not of.exchange:
            raise _lacks(path, of, f"state.{channel}.start", "what a window begins with")
        states[channel] = {
            "output": named(given.get("output"), f"state.{channel}.output"),
            "start": "" if start == NONE else named(start, f"state.{channel}.start"),
            "factor": factor,
        }
    inputs, ignored = [], []
    given_inputs = content.get("inputs", {})
    for actuator in profile.actuators:
        given = given_inputs.get(actuator.name)
        if given is None or not given.get("variable"):
            raise _lacks(path, of, f"inputs.{actuator.name}", "which input it is")
        if given["variable"] == NONE:
            ignored.append(actuator.name)
            continue
        measure = units.measure(actuator.si_unit) or "ratio"
        inputs.append(_input(given, actuator.name, measure, path, named))
    for channel, given in given_inputs.items():
        if channel in WIND:
            inputs.append(_input(given, channel, WIND[channel][0], path, named))
        elif channel not in profile.actuator_names:
            raise SimulatorError(
                f"{path}: inputs.{channel} is no actuator of {profile.ship.name}"
                f"{nearest(channel, [*profile.actuator_names, *WIND])}.",
                hint=f"there are {listed([*profile.actuator_names, *WIND])}.",
            )
    between = content.get("simulator", {}).get("between", BETWEEN[0])
    if between not in BETWEEN:
        raise SimulatorError(
            f"{path}: between is {str(between)!r}{nearest(str(between), BETWEEN)}.",
            hint=f"give {listed(BETWEEN)}.",
        )
    step = float(content.get("simulator", {}).get("step_s", STEP_S))
    if not 0.0 < step <= 1.0:
        raise SimulatorError(f"{path}: step_s is {step:g}.", hint="give 0.001 to 1 s.")
    parameters = {named(k, "parameters"): v for k, v in content.get("parameters", {}).items()}
    return {
        "step": step, "state": states, "inputs": inputs, "ignored": ignored,
        "parameters": parameters, "actuators": list(profile.actuator_names),
        "hold": between == "hold", "exchange": of.exchange,
    }  # fmt: skip


def _input(given: Any, channel: str, measure: str, path: str, named: Any) -> dict[str, Any]:
    where = f"inputs.{channel}"
    start = given.get("start", NONE)
    return {
        "channel": channel,
        "variable": named(given.get("variable"), f"{where}.variable"),
        "start": "" if start == NONE else named(start, f"{where}.start"),
        "factor": _factor(given, measure, f"{path}: {where}"),
    }


def _lacks(path: str, of: Description, key: str, what: str) -> SimulatorError:
    inputs = [v.name for v in of.variables if v.causality in ("input", "parameter", "output")]
    return SimulatorError(
        f"{path} does not say {what}: {key} is empty.",
        hint=f"{of.name} has {listed(inputs, most=12)}; write {NONE!r} for an actuator that it "
        "does not have.",
    )


def _factor(given: Any, measure: str, where: str) -> float:
    """What a value of the FMU is multiplied by for shiplog's unit, with its sign."""
    unit, sign = spelled(str(given.get("unit", ""))), float(given.get("sign", 1))
    if abs(sign) != 1.0:
        raise SimulatorError(f"{where}.sign is {sign:g}.", hint="give 1 or -1.")
    if measure == "shaft speed" and unit in SHAFT:
        return sign * SHAFT[unit]
    if unit not in units.TO_SI or units.measure(unit) != measure:
        fitting = units.MEASURES[measure]
        raise SimulatorError(
            f"{where}.unit is {unit!r}, which is no {measure}.", hint=f"give {listed(fitting)}."
        )
    try:
        return sign * units.factor(unit)
    except ProfileError as error:
        raise SimulatorError(error.message, hint=error.hint) from error


def spelled(unit: str) -> str:
    """A unit as shiplog calls it."""
    return SPELLED.get(unit.strip().lower(), units.spelled(unit.strip()))


def _start(of: Description, names: Sequence[str], output: Variable | None) -> Variable | None:
    for form in BEGINS[1:]:
        wanted = [form.format(one) for one in names]
        found = of.named(wanted, "parameter", "local", "input")
        if found is not None and found.settable:
            return found
    return output if output is not None and output.settable else None


def _only(of: Description, kind: str, profile: Profile) -> Variable | None:
    """The one input whose name or description says what this kind of actuator is, of a ship that
    has one of it."""
    if sum(a.kind == kind for a in profile.actuators) != 1:
        return None
    words = {"rudder": ("rudder", "delta"), "propeller": ("propeller", "rpm", "shaft", "rps")}
    inputs = [v for v in of.variables if v.causality == "input" and v.kind == "real"]
    said = [
        v for v in inputs
        if any(w in f"{v.name} {v.description}".lower() for w in words.get(kind, (kind,)))
    ]  # fmt: skip
    return said[0] if len(said) == 1 else None


def _line(key: str, found: Variable | None) -> str:
    if found is None:
        return f'{key} = ""  # CHECK no variable has a name like it'
    about = f"  # {_comment(found.description)}" if found.description else ""
    return f"{key} = {_text(found.name)}{about}"


def _unit(found: Variable | None, si: str) -> str:
    if found is None or not found.unit:
        return f'unit = "{si}"  # CHECK the description states no unit'
    unit = spelled(found.unit)
    known = unit in units.TO_SI or unit in SHAFT
    return f"unit = {_text(unit)}" + ("" if known else f"  # CHECK one of {si} and the like")


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _text(value: str) -> str:
    """A string of TOML, of a name that may hold anything."""
    import json

    return json.dumps(value)


def _comment(text: str) -> str:
    """On one line, without what a terminal would act on."""
    return "".join(c for c in text if c.isprintable())[:80].replace("CHECK", "check")
