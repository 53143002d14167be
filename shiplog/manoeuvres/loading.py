"""A ship at full load, from trials in ballast: R = T F/B (IMO MSC/Circ.1053, 1.3.2; ITTC
7.5-04-02-01).

    T  measured in ballast,  B  predicted in ballast,  F  predicted at full load

The model of the ballast condition is brought to the deeper draught by published laws of it: each
coefficient is multiplied by the ratio of what the formulas of `models.mmg.estimate` give at both
draughts (Kijima et al. 1990 for the hull, and those that the file names), and the displacement
grows by the waterplane, C_W = (1 + 2 C_B)/3 (Schneekluth & Bertram 1998). Such laws differ from
each other by up to half of the change, so that a member's ratio is taken to the power 1 + ½ ε,
ε ~ N(0, 1).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from shiplog.exceptions import ProfileError
from shiplog.manoeuvres.quantity import Estimate
from shiplog.models.mmg import MMG, estimated, geometry_of
from shiplog.nomenclature.numbers import NINETY_SPREADS
from shiplog.ship_profile.profile import Profile
from shiplog.training.runs.sailing_run import Sailor

LAW_SPREAD = 0.5  # of the logarithm of the change, by which published laws of draught differ
LEAST = 1e-9  # of a coefficient, below which a ratio means nothing


def at_full_load(profile: Profile) -> Profile:
    """The ship at its second draught. Raises ProfileError where the profile has none."""
    ship = profile.ship
    deep, draught = ship.full_load_draught_m, ship.draught_m
    if deep is None or draught is None or ship.breadth_m is None:
        raise ProfileError(
            f"The profile of {ship.name} has no "
            f"{'full_load_draught_m' if deep is None else 'draught and breadth'}, and nothing can "
            "be said of its full load.",
            hint="give [ship] draught_m, breadth_m and full_load_draught_m, and ingest and train "
            "again.",
        )
    main = geometry_of(profile)[1]
    plane = (1.0 + 2.0 * main.block) / 3.0 * main.length * main.breadth
    mass = main.mass + main.density * plane * (deep - draught)
    block = mass / (main.density * main.length * main.breadth * deep)
    loaded = ship.model_copy(
        update={"draught_m": deep, "mass_kg": mass, "block_coefficient": min(block, 1.0)}
    )
    return profile.model_copy(update={"ship": loaded, "source": ""})


class Loaded(Sailor):
    """A run's MMG at full load; members are the draws of the run in ballast, one for one."""

    def __init__(self, sailor: Sailor) -> None:
        super().__init__(sailor.run)
        first = self._physics[0]
        if first is None or not isinstance(first.model, MMG):
            raise ProfileError(
                f"{sailor.run.name} is no MMG, whose coefficients have laws of draught.",
                hint="give a run of `train --model mmg`.",
            )
        deep, without = at_full_load(self.profile), self.run.config.physics.without
        ship, main, _ = geometry_of(deep, without)
        before, main_before, _ = geometry_of(self.profile, without)
        loaded, ballast = estimated(ship, main), estimated(before, main_before)
        self.ratio = _ratio(loaded.values, ballast.values)
        model: Any = replace(first.model, geometry=ship)
        self._physics = [
            None if one is None else replace(one, model=model, theta=one.theta * self.ratio)
            for one in self._physics
        ]
        self._ballast = sailor
        self._discrepancy = sailor.discrepancy

    @property
    def note(self) -> str:
        ship, deep = self.profile.ship, self.profile.ship.full_load_draught_m
        return (
            f"Full load, {deep:g} m of draught instead of {ship.draught_m:g}: R = T F/B of what "
            "was measured. F/B is by published laws of draught, which are taken to differ by half "
            "of the change. Of what the model alone sails it is F."
        )

    def _drawn(self, count: int, rng: np.random.Generator) -> np.ndarray:
        found = self._ballast._drawn(count, rng)
        laws = np.random.default_rng(1).standard_normal((count, 1))
        laws[:1] = 0.0
        return found * self.ratio ** (1.0 + LAW_SPREAD * laws)


def loaded(sailor: Sailor | None) -> Loaded:
    """Raises ProfileError without a run, or a second draught."""
    if sailor is None:
        raise ProfileError(
            "Full load is predicted by a model, and no run is given.",
            hint="name a run that no diagnosis extended.",
        )
    return Loaded(sailor)


def _ratio(loaded: np.ndarray, ballast: np.ndarray) -> np.ndarray:
    """1 where a coefficient is zero or changes its sign: no law says how it grows."""
    same = (np.abs(ballast) > LEAST) & (loaded * ballast > 0.0)
    return np.where(same, loaded / np.where(same, ballast, 1.0), 1.0)


def full_load(
    measured: Mapping[str, Estimate],
    ballast: Sequence[Mapping[str, float]],
    loaded: Sequence[Mapping[str, float]],
) -> dict[str, Estimate]:
    """R of each quantity: T F/B of the model as it stands, its first member, with the middle 90 %
    of T_k F_k/B_k over the members, T_k drawn from the measurement's interval."""
    found = {}
    rng = np.random.default_rng(2)
    for name, one in measured.items():
        if name not in ballast[0] or name not in loaded[0] or not ballast[0][name]:
            continue
        value = one.value * loaded[0][name] / ballast[0][name]
        pairs = [
            f[name] / b[name]
            for f, b in zip(loaded[1:], ballast[1:], strict=False)
            if name in f and name in b and b[name]
        ]
        if not pairs:
            found[name] = Estimate(value, value, value)
            continue
        spread = (one.high - one.low) / (2.0 * NINETY_SPREADS)
        drawn = (one.value + spread * rng.standard_normal(len(pairs))) * np.array(pairs)
        low, high = np.quantile(drawn, (0.05, 0.95))
        found[name] = Estimate(value, min(value, float(low)), max(value, float(high)))
    return found
