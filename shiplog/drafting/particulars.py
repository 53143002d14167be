"""Lines of a draft on the ship and on its actuators: what a model needs and no log says."""

from __future__ import annotations

import re

SHIP = (
    "length_m = 1.0  # CHECK: the {what} does not say; between perpendiculars\n"
    "# breadth_m = 0.0  # CHECK: estimated of the length where left out\n"
    "# draught_m = 0.0  # CHECK: likewise\n"
    "# mass_kg = 0.0  # CHECK: estimated of length, breadth and draught where left out\n"
)
STATED = (  # of a recorder that says all else: what is left to fill in
    "length_m = 1.0  # CHECK: the {what} does not say; between perpendiculars\n"
    "# breadth_m = 0.0  # CHECK: estimated of the length where left out\n"
    "# draught_m and mass_kg are estimated of length and breadth where they are left out\n"
)
PLACE = "position_m = [0.0, 0.0]  # CHECK: ahead and to starboard of midship\n"
DIMENSIONS = {  # of an actuator, which only physical models ask for
    "rudder": "# area_m2 = 0.0  # CHECK: estimated by train --model mmg where left out\n"
    "# span_m = 0.0  # CHECK: likewise\n",
    "propeller": "# diameter_m = 0.0  # CHECK: train --model mmg needs it\n",
    "thruster": "# diameter_m = 0.0  # CHECK: of its propeller\n"
    "direction_deg = 0.0  # CHECK: 0 where it pushes ahead, 90 to starboard, of a bow thruster\n",
    "azimuth": "",
}
FULL = 1.05  # of full command: a share of more is none
FASTEST_RPS = 50.0  # rev/s: no propeller turns faster, and a number beyond counts minutes
LIMITED = ("rpm", "rps", "rev/s", "deg", "rad")  # units of a thruster that has to have `limits`


def unit_by_size(name: str, most: float | None) -> tuple[str, str]:
    """(unit, what to check) of a thruster's command that states no unit: a share is no more than
    1, and what turns is called a speed."""
    if most is None or most <= FULL:
        return "1", ""
    if re.search(r"speed|rpm|rps|rev", name, re.IGNORECASE):
        unit = "rpm" if most > FASTEST_RPS else "rps"
    else:
        unit = "%" if most <= 100.0 * FULL else "permille"
    return unit, f"its values go up to {most:.4g}"


def of_actuator(kind: str, unit: str, most: float | None = None, place: str = "") -> str:
    """Where an actuator stands and how large it is, each line to be checked.

    unit    of its values
    most    the largest of them, where known
    place   what the data say of where it stands
    """
    where = PLACE.replace("\n", f"; {place}\n") if place else PLACE
    text = where + DIMENSIONS[kind]
    if kind == "thruster" and unit in LIMITED:
        seen = f"; {most:.4g} was the most in this record" if most else ""
        text += f"# limits = [-1.0, 1.0]  # CHECK: of full thrust, in {unit}{seen}\n"
    return text
