"""A simulator that answers here, without a child: the MMG of a ship, as somebody else's."""

import numpy as np

from shiplog.foreign import integrate
from shiplog.foreign.trying import slopes
from shiplog.models.mmg import MMG


class Here:
    """As `shiplog.foreign.model.Foreign`."""

    names, substeps, smooth = (), 1, 0.0

    def __init__(self, model: MMG, theta: np.ndarray, step: float = 1e-5) -> None:
        self.model, self.theta, self.step = model, theta, step

    def rates(self, rows):
        """ν̇ by numpy, and no troubles."""
        state, acts, wind = rows[:, :6], rows[:, 6:-3], rows[:, -3:-1]
        return np.asarray(self.model.acceleration(self.theta, state, acts, wind)), []

    def exact(self, rows):
        return None

    def _rows(self, state, driven):
        return np.concatenate((state, driven, np.zeros((len(state), 1))), 1)

    def accelerations(self, state, driven):
        return self.rates(self._rows(state, driven))[0]

    def slopes(self, state, driven):
        rows = self._rows(state, driven)
        (middle, by), _ = slopes(self, rows, np.full(rows.shape[1] - 1, self.step))
        return middle, by[..., :6], by[..., 6:]

    def roll(self, start, driven, dt, begin):
        return integrate.by_rates(self.rates, start, driven, dt, begin)

    def along(self, start, acceleration, driven, step):
        return integrate.along(self.rates, start, acceleration, driven, step)[0]
