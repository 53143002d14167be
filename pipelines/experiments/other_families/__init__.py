"""Ships of other families: simulators that share nothing with shiplog but the writer of logs.

    ship       what a ship is to the rest: body, actuators, coefficients, a compiled force function
    abkowitz linear_dp catamaran azimuth_ferry shipmmg_kvlcc2      one family a file
    water disturbance      shallow water, bank, wind; gusts and process noise
    effects    what can be hidden, and its realistic size in units of the ship
    operators motion voyage      who steers; equations of motion; one voyage
    instruments profiles      the log and the ship.toml that belongs to it
    cases      nominal and trial campaign, and the key

`shipmmg_kvlcc2` is an MMG, as the model is, of another package: its motion, propeller and rudder
are the model's.

Two families of forms must not win because one pen wrote both: laws, exponents and noise times here
are taken from other sources than those of `shiplog.models.causes`, and a test compares them.
"""

from __future__ import annotations

from pipelines.experiments.other_families import effects
from pipelines.experiments.other_families.cases import FAMILIES
from pipelines.experiments.other_families.effects import OUTSIDE

__all__ = ["FAMILIES", "OUTSIDE", "offered"]


def offered(family: str, seed: int = 0) -> tuple[str, ...]:
    """What can be hidden in this ship of a family, of the catalogue and outside it. Not every ship
    of a family has the same sensors and rudders."""
    return effects.offered(FAMILIES[family](seed))
