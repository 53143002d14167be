"""What an identified model says of itself: thrust against resistance and weight, in closed form."""

import numpy as np
import polars as pl
import pytest

from shiplog.ship_profile import file as profiles
from shiplog.training.runs import plausible_model
from shiplog.voyages.contradictions import plausible_measures
from shiplog.voyages.contradictions.plausibility import findings

SHIP = profiles.load("blueboat")  # 15 kg, two thrusters


def steady(thrust: float, resistance: float, seconds: int = 60):
    """Forces [N] and rows of a boat that goes ahead at 1 m/s."""
    zero = np.zeros(seconds)
    rows = pl.DataFrame({"surge": zero + 1.0, **{a.name: zero + 0.5 for a in SHIP.actuators}})
    parts = {"hull": zero - resistance, "thruster": zero + thrust}
    forces = pl.concat(
        pl.DataFrame({"part": [name] * seconds, "surge": force}) for name, force in parts.items()
    )
    return forces, rows


@pytest.mark.parametrize(
    ("thrust", "resistance", "said"),
    [
        (10.0, 10.0, []),
        (0.17, 10.0, ["actuators.thruster_port.sign"]),  # its polarity turned round
        (-3.0, 10.0, ["actuators.thruster_port.sign"]),
        (1000.0, 900.0, ["ship.mass_kg"]),  # seven times its weight
    ],
)
def test_thrust_is_held_against_resistance_and_weight(thrust, resistance, said):
    asked = plausible_model.measured(*steady(thrust, resistance), SHIP)
    found = findings(asked)
    assert [f.sentence.partition("look at ")[2].split(",")[0] for f in found] == said


def test_a_model_in_which_nothing_stands_off_midship_steers_nothing():
    assert findings(plausible_measures.of_model(SHIP)) == []
    middle = tuple(a.model_copy(update={"position_m": (0.0, 0.0)}) for a in SHIP.actuators)
    at_midship = SHIP.model_copy(update={"actuators": middle})
    (found,) = findings(plausible_measures.of_model(at_midship))
    assert found.kind == "implausible" and "position_m" in found.sentence
