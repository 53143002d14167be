"""The noise of jittered copies, Eq. 15, from a random stream of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch

from shiplog.nomenclature import channels
from shiplog.voyages.windows.windows import Windows


def jittered(windows: Windows, generator: torch.Generator) -> Windows:
    """Normal noise on the velocities of every copy above 0, Eq. 15 with Σ_x of Table 5.

    Actuators and wind stay as measured. Noise is independent in time, between copies and between
    windows: slices that overlap share no noise, where Eqs. 17 and 18 give each second of a copy
    one value.
    """
    noisy = (windows.plan["copy"] > 0).to_numpy().astype(np.float64)
    noise = torch.randn(windows.state.shape, generator=generator, dtype=torch.float64).numpy()
    sigma = np.array(channels.JITTER)
    return replace(windows, state=windows.state + noise * sigma * noisy[:, None, None])
