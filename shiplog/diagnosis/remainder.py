"""What remains together with the causes of a hypothesis, and how much process noise it expects."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis.likelihood import ProcessNoise

NOMINAL, RAISED, INTERMITTENT = "nominal", "raised", "intermittent"
CHANGE_SIZES = (1.0, 3.0, 9.0)  # of a change of a family's weights, in units of the process noise
LEAST_SPREAD = 0.05  # of the logarithm of the process noise: two campaigns are never alike
RAISED_SPREAD = 1.0  # the same where the process noise is raised: by e, either way


@dataclass(frozen=True)
class Remainder:
    """What remains together with the causes.

    kind          NOMINAL, RAISED, INTERMITTENT, or a family of the discrepancy
    size          of a change of that family's weights
    noisy         whether process noise is raised together with that change
    intermittent  root mean square acceleration [m/s², m/s², rad/s²] of an intermittent force, where
                  it is a device's
    """

    kind: str = NOMINAL
    size: float = 1.0
    noisy: bool = False
    intermittent: tuple[float, float, float] | None = None

    @property
    def raises(self) -> bool:
        """Whether the process noise is expected to be raised."""
        return self.noisy or self.kind in (RAISED, INTERMITTENT)

    def in_noise(self, process_noise: ProcessNoise) -> ProcessNoise:
        """The process noise with the intermittent force in it."""
        if self.intermittent is None:
            return process_noise
        return replace(process_noise, intermittent=np.array(self.intermittent))


def noise_prior(noise: float, nominal: float, remainder: Remainder) -> float:
    """Log prior density of a level of process noise together with a remainder, less the greatest
    one together with NOMINAL.

    noise   factor of the nominal process noise
    nominal standard deviation of its logarithm from campaign to campaign
    """
    spread = RAISED_SPREAD if remainder.raises else nominal
    return -0.5 * (math.log(noise) / spread) ** 2 - math.log(spread / nominal)
