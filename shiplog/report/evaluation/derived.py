"""What of a ship's motion was measured and what was derived, in words, and what that adds to L."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from shiplog.logs.health.health_report import DerivedChannel, VoyageReport
from shiplog.nomenclature import units
from shiplog.nomenclature.channels import VELOCITY
from shiplog.nomenclature.numbers import figure
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.scoring import loss_of_deviations

MEASURABLE = ("position", "heading", "yaw_rate")  # of motion, together with a velocity


def of_profile(profile: Profile) -> str:
    """Measured and derived channels of a ship's voyages; empty where all were measured."""
    sensors = profile.sensors
    if not sensors.derived:
        return ""
    measured = [name for name in MEASURABLE if getattr(sensors, name) is not None]
    return (
        f"Measured: {_words(measured)}. Derived from them by a Kalman smoother: "
        f"{_words(sensors.derived)}; a diagnosis counts none of these as a measurement."
    )


def of_voyages(derived: Sequence[DerivedChannel]) -> str:
    """The same with their standard deviations; empty where all were measured."""
    if not derived:
        return ""
    known = ", ".join(
        f"{_words([one.channel])} ± {figure(one.sigma)} {one.unit}" for one in derived
    )
    sources = {one.of: one for one in derived}
    samples = ", ".join(
        f"a {of} scatters by {figure(one.sample_sigma)} {'m' if of == 'position' else 'deg'}"
        for of, one in sources.items()
    )
    return (
        f"derived by a Kalman smoother, none of them measured: {known} (one standard deviation; "
        f"{samples})"
    )


def together(reports: Iterable[VoyageReport]) -> tuple[DerivedChannel, ...]:
    """Of several voyages: the root mean squares of each channel's standard deviations."""
    found: dict[str, list[DerivedChannel]] = {}
    for report in reports:
        for one in report.derived:
            found.setdefault(one.channel, []).append(one)
    numbers = ("sigma", "sigma_mean", "sample_sigma", "jerk")
    return tuple(
        DerivedChannel(
            channel=channel, of=many[0].of, unit=many[0].unit,
            **{n: math.sqrt(np.mean([getattr(one, n) ** 2 for one in many])) for n in numbers},
        )
        for channel, many in found.items()
    )  # fmt: skip


def expected_loss(derived: Sequence[DerivedChannel], seconds: float) -> float:
    """L that a perfect model has on a window of so many seconds, since what it is compared with is
    derived: `loss_of_deviations` of the means over a second."""
    si = {one.channel: one.sigma_mean * units.factor(one.unit) for one in derived}
    return loss_of_deviations([si.get(channel.name, 0.0) for channel in VELOCITY], seconds)


def loss_sentence(derived: Sequence[DerivedChannel], seconds: float) -> str:
    """What the derived velocities add to L; empty where all were measured."""
    if not derived:
        return ""
    least = figure(expected_loss(derived, seconds))
    head = of_voyages(derived)
    return f"{head[:1].upper()}{head[1:]}. A perfect model would have L {least} on these windows."


def _words(names: Iterable[str]) -> str:
    """In their order: "surge, sway and yaw rate"."""
    *most, last = (name.replace("_", " ") for name in names)
    return f"{', '.join(most)} and {last}" if most else last
