"""Signs in which a log and a profile may differ, tried one at a time.

No coefficient corrects a rudder of the wrong sign. If a model does not simulate the ship at all,
its sign conventions are tested first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from shiplog.profile import Profile
from shiplog.simulation.error_reduction import RUNAWAY
from shiplog.simulation.extended_simulator import ExtendedSimulator
from shiplog.voyages.windows import Windows


def best(simulator: ExtendedSimulator, cut: Windows) -> tuple[str, float]:
    """The change of convention with the smallest mean L on these windows, in words, and that L. A
    window in which the model diverges has an L of RUNAWAY."""
    tried = []
    for words, turned in other(simulator.profile, cut):
        each = np.nan_to_num(simulator.losses(turned), nan=RUNAWAY, posinf=RUNAWAY)
        tried.append((words, float(np.minimum(each, RUNAWAY).mean())))
    return min(tried, key=lambda pair: pair[1])


def other(profile: Profile, cut: Windows) -> Iterator[tuple[str, Windows]]:
    """Each convention turned round: signs of actuators of a kind, twins exchanged, the wind blowing
    towards where it is reported to come from."""
    actuators = profile.actuators
    for kind in dict.fromkeys(a.kind for a in actuators):
        columns = [i for i, a in enumerate(actuators) if a.kind == kind]
        turned = cut.actuator.copy()
        turned[..., columns] *= -1.0
        yield f"the {kind}'s sign turned round", replace(cut, actuator=turned)
        if len(columns) == 2:
            swapped = cut.actuator.copy()
            swapped[..., columns] = cut.actuator[..., columns[::-1]]
            yield f"the two {kind}s exchanged", replace(cut, actuator=swapped)
    if cut.wind.shape[-1]:
        ahead = cut.wind + np.array([0.0, math.pi])
        yield (
            "the wind direction as the one that it blows towards",
            replace(cut, wind=ahead),
        )
