"""The pages catalogue.md and coefficients.md of docs/reference, from the code that they describe.

python -m pipelines.experiments.model_reference --docs docs/reference
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from shiplog.models.causes import CATALOGUE
from shiplog.models.causes.base import Cause, Parameter
from shiplog.models.causes.environment import ShallowWater
from shiplog.models.causes.lines import LEAST_PULL, PULL
from shiplog.models.causes.steering import RudderOffset
from shiplog.models.coefficients import ParameterEntry
from shiplog.models.mmg.parameters import TABLE
from shiplog.report.evaluation import tables

CATALOGUE_HEAD = """# The catalogue of causes

What `shiplog diagnose` tests and can name. Each cause is a term of the model that is zero where the
cause is absent. The [method](../science/method.md) says how one is chosen,
[a cause of your own](../use/own_cause.md) how to add one.

The *realistic size* is the standard deviation of a change between two campaigns, from the
literature that the cause's docstring names. Below the *practical size* a cause counts as no change.
A cause that needs what the ship, its profile or the place lacks is listed as not testable, with
that reason."""

PARAMETERS = {  # as the report prints them
    "current": "`speed` (m/s), `direction` (deg, towards, clockwise from north)",
    "wind_force": "`surge_factor`, `sway_factor`, `yaw_factor` (of the model's force)",
    "shallow_water": "`strength` (at the shallowest place: 0.3 at twice the draught)",
    "bank": "`strength` (1 is a bank as published formulas have it)",
    "line": "`x0`, `y0` (m, the point) or `direction` (deg, towards, where the point is too far "
    "away), `pull` (N, as it was on average), `stiffness` (N/m; a constant pull has none), "
    "`position` (m ahead of midship, where it is made fast)",
    "tow": "`pull` (N), `direction` (deg, towards, in the middle of the campaign), `turn` (deg, "
    "from its begin to its end, clockwise), `position` (m ahead of midship)",
    "contact": "`force` (N, where it touches), `reach` (m, the gap at which 37 % of it is left), "
    "`friction` (of the force, along the wall)",
    "fouling": "`factor` (of the resistance)",
    "payload": "`mass` (kg), `position` (m ahead of midship)",
    "cross_flow_drag": "`factor`",
    "thrust_loss": "`factor` (0.7: 30 % of the thrust is lost), `actuator` if it is one of several",
    "thrust_drift": "`slope` (change of the thrust over the campaign, as a share)",
    "rudder_force": "`factor`",
    "rudder_offset": "`port`, `starboard` or `angle` (deg, acting minus recorded)",
    "rudder_lag": "`time` (s, of the first order)",
    "rudder_delay": "`time` (s)",
    "actuator_limit": "`limit` (deg, rev/s or 1), `actuator` (a unit, or all of a kind)",
    "actuator_rate": "`rate` (deg/s, rev/s/s or 1/s), `actuator`",
    "actuator_dead_band": "`half_width` (deg, rev/s or 1), `actuator`",
    "actuator_stuck": "`value` (deg, rev/s or 1), `share` of the quarter of the campaign `part`, "
    "`actuator`",
    "actuator_coupling": "`share` (of the other unit's order), `actuator`, `of` (the other unit)",
    "actuators_exchanged": "`share` (1: wholly), `actuator`, `other`",
    "heading_offset": "`angle` (deg, measured minus true)",
    "yaw_rate_bias": "`value` (deg/s, measured minus true)",
    "yaw_rate_scale": "`value` (measured over true)",
    "clock_offset": "`time` (s, positive where the channel is late against the heading), `channel` "
    "(`position`, `velocity`, `gnss` for both, `yaw_rate`, `wind`)",
    "antenna_offset": "`x` ahead, `y` to starboard (m from where the profile has it)",
    "wind_direction_offset": "`angle` (deg, measured minus true)",
    "wind_speed_scale": "`value` (measured over true)",
}
REACH = "of the largest order"
ON_BOARD = "0.3 of the ship's length off midship"
LEAST = f"{LEAST_PULL:g} N per kg of the ship"
WITHOUT_PARAMETERS = {  # numbers that are made for each ship: realistic and practical size
    "line": (f"{PULL:g} N per kg of the ship, 0.7 of its bend, {ON_BOARD}", LEAST),
    "tow": (f"{PULL:g} N per kg of the ship, {ON_BOARD}", LEAST),
    "contact": (
        "0.01 N per kg of the ship, friction 0.3, reach 0.1 of the ship's length",
        "0.0005 N per kg of the ship",
    ),
    "shallow_water": tuple(f"{size:g}" for size in (ShallowWater.realistic, ShallowWater.least)),
    "rudder_offset": tuple(
        f"{np.degrees(size):.3g} deg" for size in (RudderOffset.realistic, RudderOffset.least)
    ),
    "actuator_limit": (f"a third {REACH}", f"0.95 {REACH}"),
    "actuator_rate": ("10 √(length/g) from zero to the largest order", "0.5 √(length/g)"),
    "actuator_dead_band": (f"0.075 {REACH}", f"0.01 {REACH}"),
    "actuator_stuck": ("all of the order", "0.2 of a quarter"),
}
NEEDED = {
    "yaw rate": "a yaw rate sensor",
    "velocity": "a velocity",
    "body velocity": "a velocity in body axes",
    "wind": "a wind sensor",
    "wind force": "a wind force in the model",
    "rudder": "a rudder",
    "steering": "a rudder, or azimuths",
    "thrust": "a propeller or thruster",
    "bank": "`banks` in the profile's `[site]`",
}
OF = {
    "speed": "of the ship's rms speed", "length": "of the ship's length",
    "mass": "of the ship's mass", "moment": "of mass times length",
}  # fmt: skip
KINDS = {"environment": "Surroundings", "ship": "Ship", "sensor": "Instruments"}

CATALOGUE_TAIL = """
`side_thrust` is an unrecorded thruster: a lateral force at one place that is on or off. It is
found among the remainders rather than tested as a cause. Its parameter is `force` (N); `times`
lists when it is on.

## Causes that resemble each other

A report proposes the test that separates a named cause from another one that these data cannot
exclude. The notes of an undecided verdict propose it for each two of its candidates.
"""

COEFFICIENTS_HEAD = """# The coefficients of the physics

These are the keys of `<profile>.mmg.toml` (or `--parameters FILE`), and of `seed0/parameters.toml`
in a run. `--free` takes the same names: `--free 'wind.*'` identifies the wind's coefficients alone.
[physics.md](../science/physics.md) describes the forces.

    source = "model tests of 2024"

    [hull]
    y_v = -0.3728
    n_v = -0.1458

    [wind]
    y1 = 1.058

A file has a section for each force that the ship has. A force that it lacks is left out with
`--without`, which takes propeller, rudder, thruster and wind; the hull always stays. A value that
is missing is named; one outside its range is refused. Where a neutral value is given, a file may
leave the key out. Without a file, all coefficients are estimated from the particulars.

Hull forces are made non-dimensional by ½ρL_pp d U², and moments by ½ρL_pp² d U², with the draught
d. Added masses are made so by ½ρL_pp² d, inertia by ½ρL_pp⁴ d about the centre of gravity, and wind
forces by the areas above water. The *spread* below is the standard deviation by which a coefficient
may plausibly differ from a published value. It is a share of that value, or the least amount if
that is more. For estimated coefficients it is twice as large. Identification penalises differences
from the starting value in units of the spread, and stays inside the range."""


def catalogue() -> str:
    """The page of causes."""
    parts = [CATALOGUE_HEAD.strip(), ""]
    for kind, title in KINDS.items():
        rows = {c.name: _cause(c) for c in reversed(CATALOGUE) if c.kind == kind}
        head = ("cause", "meaning", "parameters", "realistic size", "practical size", "needs")
        parts += [f"## {title}\n", tables.table(head, [*reversed(rows.values())]), ""]
    pairs = {
        (c.name, other): (f"`{c.name}`", f"`{other}`", test)
        for c in CATALOGUE
        for other, test in c.separated_by.items()
    }
    parts += [CATALOGUE_TAIL.strip(), ""]
    parts += [
        tables.table(("cause", "resembles", "test that separates them"), [*pairs.values()]),
        "",
    ]
    return "\n".join(parts)


def _cause(cause: Cause) -> tuple[str, ...]:
    realistic, practical = WITHOUT_PARAMETERS.get(cause.name) or (
        _sizes(cause.parameters, "prior"),
        _sizes(cause.parameters, "least"),
    )
    needs = " and ".join(NEEDED[need] for need in cause.needs) or "-"
    return (f"`{cause.name}`", cause.story, PARAMETERS[cause.name], realistic, practical, needs)


def _sizes(parameters: tuple[Parameter, ...], which: str) -> str:
    """Each size once, in the unit of the report."""
    sizes = []
    for one in parameters:
        value = getattr(one, which)
        if one.unit.startswith("deg"):
            value = np.degrees(value)
        unit = OF.get(one.of, "" if one.unit == "1" else one.unit)
        sizes.append(f"{value:.3g} {unit}".strip())
    return ", ".join(dict.fromkeys(sizes))


def coefficients() -> str:
    """The page of coefficients."""
    parts = [COEFFICIENTS_HEAD.strip(), ""]
    for part, entries in TABLE.items():
        parts.append(f"## [{part}]\n")
        if part == "thruster":
            parts.append("Keys begin with the thruster's name in the profile: `bow_ahead`.\n")
        head = ("key", "symbol", "what it is", "unit", "spread", "range", "neutral")
        parts += [tables.table(head, [_coefficient(part, *one) for one in entries.items()]), ""]
    return "\n".join(parts)


def _coefficient(part: str, key: str, entry: ParameterEntry) -> tuple[str, ...]:
    spread = f"{100 * entry.share:.3g} %" if entry.share else ""
    if entry.least:
        spread += f"{', at least ' if spread else ''}{entry.least:g}"
    neutral = "-" if entry.neutral is None else f"{entry.neutral:g}"
    name = f"NAME_{key}" if part == "thruster" else key
    return (
        f"`{name}`", entry.symbol, entry.meaning, entry.unit, spread,
        f"{entry.low:g} to {entry.high:g}", neutral,
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--docs", type=Path, default=Path("docs/reference"), help="the folder of the pages"
    )
    folder = parser.parse_args().docs
    (folder / "catalogue.md").write_text(catalogue(), encoding="utf-8")
    (folder / "coefficients.md").write_text(coefficients(), encoding="utf-8")


if __name__ == "__main__":
    main()
