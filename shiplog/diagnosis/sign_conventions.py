"""Signs in which a log and a profile may differ, tried one at a time.

A rudder that turns the other way is no force of the ship, and no coefficient mends it: where a
model simulates nothing, this is what to ask first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import torch

from shiplog.profile import Profile
from shiplog.simulation.error_reduction import RUNAWAY
from shiplog.simulation.extended_simulator import ExtendedSimulator
from shiplog.voyages.windows import Windows


def best(simulator: ExtendedSimulator, cut: Windows) -> tuple[str, float]:
    """The convention that makes the mean L of these windows least when it is turned round, in
    words, and that L."""
    tried = [
        (said, float(np.minimum(simulator.losses(turned), RUNAWAY).mean()))
        for said, turned in other(simulator.profile, cut)
    ]
    return min(tried, key=lambda pair: pair[1])


def other(profile: Profile, cut: Windows) -> Iterator[tuple[str, Windows]]:
    """Each convention turned round: signs of actuators of a kind, twins exchanged, the wind blowing
    towards where it is said to come from."""
    actuators = profile.actuators
    for kind in dict.fromkeys(a.kind for a in actuators):
        columns = [i for i, a in enumerate(actuators) if a.kind == kind]
        turned = cut.actuator.clone()
        turned[..., columns] *= -1.0
        yield f"the {kind}'s sign turned round", replace(cut, actuator=turned)
        if len(columns) == 2:
            swapped = cut.actuator.clone()
            swapped[..., columns] = cut.actuator[..., columns[::-1]]
            yield f"the two {kind}s exchanged", replace(cut, actuator=swapped)
    if cut.wind.shape[-1]:
        ahead = cut.wind + torch.tensor([0.0, math.pi], dtype=cut.wind.dtype)
        yield "the wind blowing towards where it is said to come from", replace(cut, wind=ahead)
