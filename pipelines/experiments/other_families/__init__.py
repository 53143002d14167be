"""Ships of other families: simulators that share nothing with shiplog but the writer of logs.

    ship       what a ship is to the rest: body, actuators, coefficients, a compiled force function
    abkowitz linear_dp catamaran azimuth_ferry shipmmg_kvlcc2      one family a file
    container naval_vessel       the same, with roll
    water disturbance      shallow water, bank, wind; gusts and process noise
    gear lines             units that do not do as recorded; lines, tows and fenders
    effects devices        what can be hidden, and its realistic size in units of the ship
    operators berthing     who steers, and who calls at the wall
    motion roll voyage     equations of motion, without and with roll; one voyage
    instruments profiles      the log and the ship.toml that belongs to it
    cases      nominal and trial campaign, and the key

`shipmmg_kvlcc2` is an MMG, as the model is, of another package: its motion, propeller and rudder
are the model's.

Two families of forms must not win because one pen wrote both: laws, exponents and noise times here
are taken from other sources than those of `shiplog.models.causes`, and a test compares them.
"""

from __future__ import annotations

from pipelines.experiments.other_families import devices, effects
from pipelines.experiments.other_families.cases import FAMILIES
from pipelines.experiments.other_families.effects import OUTSIDE

__all__ = ["FAMILIES", "OUTSIDE", "devices_of", "offered"]


def offered(family: str, seed: int = 0) -> tuple[str, ...]:
    """What can be hidden in this ship of a family, of the catalogue and outside it. Not every ship
    of a family has the same sensors and rudders."""
    return effects.offered(FAMILIES[family](seed))


def devices_of(family: str, seed: int = 0) -> tuple[str, ...]:
    """The same of actuators, lines, tows and contact, in a block; `devices` has them."""
    return tuple(n for n in devices.offered(FAMILIES[family](seed)) if n not in devices.ALONE)
