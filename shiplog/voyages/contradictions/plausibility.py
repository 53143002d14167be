"""What can be of a ship: one table of limits, asked of its profile, its voyages and its model.

A wrong unit changes a number by a factor of 10 to 1000, a wrong place by a ship's length. So each
row of the table compares a ratio that the laws of similarity keep alike for ships of all sizes
with what ships have. Outside the usual limits it is a question (kind `implausible`); outside the
possible ones the profile or the log is wrong (kind `contradiction`, reason `unit`).

    ∇/(L B T) = m/(ρ L B T),  Fn = U/√(g L),  J = U/(n D),  r' = r L/U,  T/(m g)
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from shiplog.exceptions import listed
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.numbers import counted, figure

SHIP = "ship"  # the channel of a finding that is about the particulars
MONOHULL = "monohull"  # a profile calls a ship so where it states the block coefficient of a hull
LEAST_BLOCK = 0.3  # of one hull; a smaller one is that of a multihull's rectangle
NEVER = math.inf
MOST_RATIOS = 2  # of one finding, of which the others are counted


@dataclass(frozen=True, slots=True)
class Limit:
    """One row of the table: what is compared, with which limits, and what to change.

    usual     [least, most] of ships; outside it is a question
    possible  [least, most] that can be at all
    keys      of the profile, the likeliest first; {name} is the actuator's or sensor's
    slips     (factor, what was called what): the value times the factor is a usual one
    kind      of ship to which it applies; all where empty
    """

    name: str
    unit: str
    usual: tuple[float, float]
    possible: tuple[float, float]
    keys: tuple[str, ...]
    source: str
    slips: tuple[tuple[float, str], ...] = ()
    kind: str = ""

    def usually(self, value: float) -> bool:
        return self.usual[0] <= value <= self.usual[1]

    def possibly(self, value: float) -> bool:
        return self.possible[0] <= value <= self.possible[1]


OF_SLIPS = {"a length": "_m", "a mass": "_kg"}  # the keys that such a slip is of; others are units
METRES = ((0.1, "a length in dm"), (0.01, "a length in cm"), (0.001, "a length in mm"))
TONNES = ((1e3, "a mass in t"), (1e-3, "a mass in g"))
REVOLUTIONS = (
    (1 / 60, "revolutions per second that are called rpm"),
    (60.0, "revolutions per minute that are called rps"),
)
DEGREES = ((math.pi / 180.0, "degrees that are called rad"),)
RADIANS = ((180.0 / math.pi, "radians that are called deg"),)
SHIP_KEYS = ("ship.mass_kg", "ship.length_m", "ship.breadth_m", "ship.draught_m")

# Each limit with the reason for it. `usual` holds the sound ships of
# docs/evidence/measured_ships.md.
TABLE: dict[str, Limit] = {
    "displacement": Limit(
        "displacement ratio m/(rho L B T)", "1", (0.05, 1.0), (0.01, 1.0), SHIP_KEYS,
        "a hull fills its box at most; a catamaran's has water between the hulls (ITTC Symbols "
        "and Terminology List, 2021)", TONNES,
    ),
    "displacement of a monohull": Limit(
        "displacement ratio m/(rho L B T)", "1", (0.2, 1.0), (0.01, 1.0), SHIP_KEYS,
        "block coefficients are 0.35 to 0.9 (Molland, 2008)", TONNES, MONOHULL,
    ),
    "floating": Limit(
        "displacement over that of the block coefficient, m/(rho C_B L B T)", "1", (0.7, 1.4),
        (0.2, 5.0), SHIP_KEYS, "the definition of the block coefficient (ITTC, 2021)", TONNES,
        MONOHULL,
    ),
    "slenderness": Limit(
        "displacement over the cube of the length, m/(rho L^3)", "1", (2e-4, 0.15), (2e-5, 1.0),
        ("ship.mass_kg", "ship.length_m"),
        "7e-4 of a racing catamaran to 0.05 of a tug (Larsson, Eliasson & Orych, 2013)", TONNES,
    ),
    "length over breadth": Limit(
        "length over breadth", "1", (0.7, 35.0), (0.1, 300.0), ("ship.length_m", "ship.breadth_m"),
        "1 of a round buoy to 31 of a rowing eight",
    ),
    "length over draught": Limit(
        "length over draught", "1", (0.7, 300.0), (0.1, 5000.0),
        ("ship.draught_m", "ship.length_m"), "2 of a sailing yacht to 100 of a pontoon",
    ),
    "centre of gravity": Limit(
        "distance of the centre of gravity from midship over the length", "1", (0.0, 0.25),
        (0.0, 1.0),
        ("ship.x_g_m", "ship.length_m"),
        "a tenth at most of ships on an even keel (Molland, 2008)", METRES,
    ),
    "frontal area": Limit(
        "frontal area over the square of the breadth", "1", (0.03, 20.0), (3e-4, 2000.0),
        ("ship.frontal_area_m2", "ship.breadth_m"),
        "0.3 of a tanker to 3 of a sailing boat (Blendermann, 1996)",
    ),
    "lateral area": Limit(
        "lateral area over the square of the length", "1", (3e-3, 2.0), (3e-5, 200.0),
        ("ship.lateral_area_m2", "ship.length_m"),
        "0.03 of a tanker to 0.2 of a ferry (Blendermann, 1996)",
    ),
    "rudder area": Limit(
        "rudder area over length times draught, A_R/(L T)", "1", (1e-3, 0.5), (1e-5, 5.0),
        ("actuators.{name}.area_m2", "ship.length_m"),
        "1/60 of ships to 1/10 of yachts (Brix, 1993)",
    ),
    "propeller in the draught": Limit(
        "propeller's diameter over the draught, D/T", "1", (0.0, 1.0), (0.0, 10.0),
        ("actuators.{name}.diameter_m", "ship.draught_m"),
        "0.65 to 0.75 of ships (Molland, 2008)", METRES,
    ),
    "propeller": Limit(
        "propeller's diameter over the length, D/L", "1", (1e-3, 0.3), (1e-4, 1.0),
        ("actuators.{name}.diameter_m", "ship.length_m"),
        "0.02 to 0.1 of ships (Carlton, 2018)", METRES,
    ),
    "place": Limit(
        "distance from midship over the length", "1", (0.0, 0.8), (0.0, 3.0),
        ("{name}", "ship.length_m"), "half of the length is its end", METRES,
    ),
    "rudder ahead": Limit(
        "place of a rudder ahead of midship over the length", "1", (-NEVER, 0.05), (-NEVER, NEVER),
        ("actuators.{name}.position_m",),
        "it stands in the jet of a propeller, astern (Brix, 1993); a double-ended ferry has them "
        "at both ends",
    ),
    "steering": Limit(
        "largest arm of all that steers, over the length", "1", (0.01, NEVER), (0.0, NEVER),
        ("actuators.{name}.position_m",), "what stands at midship turns nothing",
    ),
    "rudder at all": Limit(
        "rudder angle", "deg", (0.0, 120.0), (0.0, 180.0), ("actuators.{name}.unit",),
        "35 to 45 of ships, 105 of a VecTwin rudder (Kang et al., 2008)", DEGREES,
    ),
    "rudder hard over": Limit(
        "largest rudder angle of a ship that turns", "deg", (2.0, NEVER), (0.0, NEVER),
        ("actuators.{name}.unit",), "a turn takes 5 deg or more (Brix, 1993)", RADIANS,
    ),
    "Froude number": Limit(
        "Froude number U/sqrt(g L)", "1", (0.0, 1.5), (0.0, NEVER),
        ("sensors.velocity.units", "ship.length_m"), "planing begins at about 1 (Faltinsen, 2005)",
    ),
    "advance ratio": Limit(
        "advance ratio U/(n D) in steady motion", "1", (0.1, 3.0), (0.02, 15.0),
        ("actuators.{name}.unit", "actuators.{name}.diameter_m"),
        "0.3 to 1.5 of open-water diagrams (Carlton, 2018)", REVOLUTIONS,
    ),
    "turning": Limit(
        "turning rate r L/U at working speed", "1", (0.0, 6.0), (0.0, 60.0),
        ("ship.length_m", "sensors.heading.unit", "sensors.velocity.units"),
        "0.3 to 1 of ships, which turn in 2 to 5 lengths (IMO MSC.137(76), 2002)",
        ((0.1, "a length in dm"), (0.01, "a length in cm"), (0.001, "a length in mm")),
    ),
    "thrust": Limit(
        "thrust at rest over the weight, 0.3 rho n^2 D^4/(m g)", "1", (0.0, 3.0), (0.0, 300.0),
        ("ship.mass_kg", "actuators.{name}.unit", "actuators.{name}.diameter_m"),
        "1e-4 of a tanker at dead slow to 1 of a racing boat; K_T at rest is 0.2 to 0.5 (Carlton, "
        "2018)", TONNES,
    ),
    "command": Limit(
        "thruster's command over full command", "1", (0.0, 1.5), (0.0, NEVER),
        ("actuators.{name}.limits", "actuators.{name}.unit"), "1 is full thrust",
        ((0.01, 'per cent, unit = "%"'), (1 / 400, 'a servo pulse, unit = "pwm"')),
    ),
    "apparent wind": Limit(
        "apparent wind speed", "m/s", (0.0, 50.0), (0.0, 75.0), ("sensors.wind.units",),
        "mean winds of a hurricane are 33 to 85 (WMO; Cerveny et al., 2017)",
        ((1852 / 3600, "knots that are called m/s"), (1 / 3.6, "km/h that are called m/s"),
         (0.01, "cm/s that are called m/s")),
    ),
    "drive of the model": Limit(
        "thrust over resistance of the fitted model in steady motion ahead", "1", (0.2, 10.0),
        (-NEVER, NEVER), ("actuators.{name}.sign", "actuators.{name}.unit"),
        "1 where nothing else drives or brakes it: Newton's law",
    ),
    "thrust of the model": Limit(
        "largest thrust of the fitted model over the weight", "1", (0.0, 3.0), (0.0, 300.0),
        ("ship.mass_kg", "actuators.{name}.diameter_m"), "as above, by the fitted coefficients",
    ),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Asked:
    """A row's question with the value that a ship has.

    channel   of the finding: an actuator, a sensor's channel or SHIP
    name      what stands for {name} in the row's keys
    of        channels of which the value is made: where one is contradicted, it says nothing
    """

    row: str
    value: float
    channel: str
    name: str = ""
    of: tuple[str, ...] = ()

    @property
    def limit(self) -> Limit:
        return TABLE[self.row]

    @property
    def wrong(self) -> bool:
        return not self.limit.usually(self.value)

    @property
    def impossible(self) -> bool:
        return not self.limit.possibly(self.value)

    @property
    def keys(self) -> tuple[str, ...]:
        return tuple(key.format(name=self.name) for key in self.limit.keys)

    @property
    def beyond(self) -> float:
        """How many times it is outside the usual limits, for the order of what is said first."""
        least, most = self.limit.usual
        return max(
            self.value / most if most > 0.0 else NEVER,
            least / self.value if self.value > 0.0 else NEVER,
        )

    def slip(self, key: str) -> str:
        """What was called what under this key, where that would make the value a usual one; else
        empty."""
        for factor, words in self.limit.slips:
            of = next((end for word, end in OF_SLIPS.items() if word in words), "")
            suits = key.endswith(of) if of else not key.endswith(("_m", "_kg"))
            if suits and self.limit.usually(self.value * factor):
                return words
        return ""

    @property
    def sentence(self) -> str:
        limit = self.limit
        unit = "" if limit.unit == "1" else f" {limit.unit}"
        return f"the {limit.name} is {self.value:.3g}{unit}, and {_between(limit)}{unit}"


def _between(limit: Limit) -> str:
    least, most = limit.usual
    if math.isinf(most):
        return f"ships have at least {figure(least)}"
    if math.isinf(least) or least <= 0.0:
        return f"ships have up to {figure(most)}"
    return f"ships have {figure(least)} to {figure(most)}"


def findings(asked: Iterable[Asked]) -> list[Finding]:
    """One finding for each key of the profile that is likely wrong: several ratios that are
    outside their limits by one number are one thing, and so is one unit of several actuators."""
    wrong = [one for one in asked if one.wrong]
    votes = Counter(key for _, key in {(one.row, key) for one in wrong for key in one.keys})
    groups: dict[str, list[Asked]] = {}
    for one in wrong:
        groups.setdefault(max(one.keys, key=lambda key: votes[key]), []).append(one)
    alike: dict[object, list[tuple[str, list[Asked]]]] = {}
    for key, group in groups.items():
        rows = frozenset(one.row for one in group)
        named = all(one.name == one.channel for one in group)
        alike.setdefault((rows, named) if named else key, []).append((key, group))
    return [_finding(several) for several in alike.values()]


def _finding(several: Sequence[tuple[str, Sequence[Asked]]]) -> Finding:
    every = [one for _, group in several for one in group]
    worst = max(every, key=lambda one: (one.impossible, one.beyond))
    key, group = next((key, group) for key, group in several if worst in group)
    order = sorted(group, key=lambda one: (one is not worst, -one.beyond))
    texts = list({one.row: one.sentence for one in reversed(order)}.values())[::-1]
    text = "; ".join(texts[:MOST_RATIOS])
    if len(texts) > MOST_RATIOS:
        text += f"; and {counted(len(texts) - MOST_RATIOS, 'ratio')} more"
    too = [one.channel for _, other in several if other is not group for one in other]
    of = f"{worst.channel}: " if worst.name else ""
    and_of = f" ({listed(dict.fromkeys(too))} likewise)" if too else ""
    slip = next((words for one in order if (words := one.slip(key))), "")
    others = [k for k in dict.fromkeys(k for one in group for k in one.keys) if k != key]
    also = f", or at {listed(others)}" if others else ""
    end = (
        f"That cannot be: {slip or 'a wrong unit'}? Look at {key}{also}."
        if worst.impossible
        else f"Is that so{f', or is it {slip}' if slip else ''}? If not, look at {key}{also}."
    )
    least, most = worst.limit.usual
    return Finding(
        "contradiction" if worst.impossible else "implausible", worst.channel,
        f"{of}{text}{and_of}. {end}" if of else f"{text[:1].upper()}{text[1:]}{and_of}. {end}",
        value=worst.value, low=least if math.isfinite(least) else None,
        high=most if math.isfinite(most) else None, unit=worst.limit.unit,
        reason="unit" if worst.impossible else "",
    )  # fmt: skip
