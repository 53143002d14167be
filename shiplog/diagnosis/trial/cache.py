"""Results that the hypotheses about one trial share. Each is computed again where it is not kept.

Only what `starts` holds is more than a saving of time: a fit of the same causes with the same
remainder begins where an earlier one converged.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Mapping

import numpy as np

from shiplog.diagnosis.linear.segments import Cut
from shiplog.diagnosis.noise.likelihood import Modes, Weighed
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.trial.fitted import Start

KEPT_MODES = 4  # 20 MB each
KEPT_TOTALS = 41  # one point needs about a dozen levels, and again for each family

Numbers = Mapping[str, np.ndarray]
Read = tuple[Cut, np.ndarray, np.ndarray]  # see `measurement_correction.read`
Key = tuple[tuple[str, ...], Remainder]  # labels of the included causes, and the remainder


class Cache:
    """Readings, modes, products and volumes of one trial, and the starts of its fits.

    A trial and its copies with other weights share one; keys hold what they differ in.
    """

    def __init__(self) -> None:
        self.starts: dict[Key, Start] = {}
        self._readings: list[tuple[Numbers, Read]] = []
        self._modes: list[tuple[Weighed, tuple, Modes]] = []
        self._totals: list[tuple[weakref.ref[Weighed], tuple, np.ndarray, float]] = []
        self._volumes: dict[tuple, float] = {}
        self._voyages: tuple[weakref.ref[Weighed], tuple, dict[object, np.ndarray]] | None = None

    def reading(
        self, alike: Callable[[Numbers], bool], numbers: Numbers, read: Callable[[], Read]
    ) -> Read:
        """The trial as read with these numbers of sensors' causes: as it is, and as it was last."""
        for before, found in self._readings:
            if alike(before):
                return found
        found = read()
        self._readings = [*self._readings[:1], (numbers, found)]
        return found

    def modes(self, weighed: Weighed, shape: tuple) -> Modes | None:
        """Of a point, for a shape of the process noise."""
        for of, known, found in self._modes:
            if of is weighed and known == shape:
                return found
        return None

    def keep_modes(self, weighed: Weighed, shape: tuple, modes: Modes) -> None:
        """The first point's, for its volume, and the last ones."""
        last = self._modes[1:][2 - KEPT_MODES :]
        self._modes = [*self._modes[:1], *last, (weighed, shape, modes)]

    def total(self, weighed: Weighed, key: tuple, size: int) -> tuple[np.ndarray, float] | None:
        """Products of a point, of `size` columns at least, and their volume."""
        for of, known, total, volume in self._totals:
            if of() is weighed and known == key and len(total) >= size:
                return total, volume
        return None

    def keep_total(self, weighed: Weighed, key: tuple, total: np.ndarray, volume: float) -> None:
        # no id(): a point that is gone leaves its own to the next one
        kept = (weakref.ref(weighed), key, total, volume)
        self._totals = [*self._totals[1 - KEPT_TOTALS :], kept]

    def volume(self, key: tuple, volume: Callable[[], float]) -> float:
        """log|R| of the first point."""
        if key not in self._volumes:
            self._volumes[key] = volume()
        return self._volumes[key]

    def voyages(self, weighed: Weighed, key: tuple) -> dict[object, np.ndarray] | None:
        """Products of each voyage, of the last point that they were asked for."""
        kept = self._voyages
        return None if kept is None or kept[0]() is not weighed or kept[1] != key else kept[2]

    def keep_voyages(self, weighed: Weighed, key: tuple, each: dict[object, np.ndarray]) -> None:
        self._voyages = (weakref.ref(weighed), key, each)
