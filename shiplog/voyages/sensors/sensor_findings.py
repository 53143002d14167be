"""One estimate of the comparison of sensors: its size and interval, what it means, its sentence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.channels import DEGREE
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows.resampling import RATE_HZ

STEP_S = 1.0 / RATE_HZ
SURE_HALF_INTERVALS = 2.0  # half intervals that a value must be from zero, to be reported
# The same of position against velocity: a receiver's error wanders for a minute and longer, which
# no block of the fit holds, and a slow ship's changes of velocity are as slow.
SURE_OF_TWO = 3.0
CERTAIN = 4.0  # the same, to be corrected with --correct
MOST_SCALE = 0.9  # of a scale beyond 1: the search's limit
DELAY_SHARE = 0.8  # of the largest delay: what ends beyond it was not found
MARGINS_S = (1.5, 6.0)  # largest delay looked for; the second where the first does not suffice
# An estimate that ends so near a limit of the search, as a share of it, was not found there.
AT_LIMIT = 0.95
# Ratios of two units: what contains one is a question of the profile, and no fault of a sensor.
UNIT_RATIOS = (1852.0 / 3600.0, 3600.0 / 1852.0, 3.6, 1.0 / 3.6, 60.0, 1.0 / 60.0, 1.0 / DEGREE,
               DEGREE, 0.44704, 1.0 / 0.44704, 0.3048, 1.0 / 0.3048, 1.15078, 1.0 / 1.15078,
               1.0 / 1.852, 1.852, 1.60934, 1.0 / 1.60934)  # fmt: skip


@dataclass(frozen=True)
class Estimate:
    """One parameter of a voyage with its 90 % interval, in the unit of its finding."""

    kind: str
    channel: str
    value: float
    low: float
    high: float
    none: float  # the value that is no fault: 0, or 1 for a scale
    least: float  # practical size
    unit: str
    rival: str = ""  # the channel that may be at fault instead: only the two together are known

    @property
    def notable(self) -> bool:
        """Well off none, and large enough to matter."""
        sure = SURE_OF_TWO if self.rival else SURE_HALF_INTERVALS
        return self._off > self.least and self._off > sure * self._half

    @property
    def certain(self) -> bool:
        """Beyond doubt, and no doubt about which instrument it is, nor about a unit."""
        return (
            self.notable
            and self._off > CERTAIN * self._half
            and not self.rival
            and not self.question
        )

    @property
    def question(self) -> bool:
        """Whether the interval reaches the search's limit, or holds the ratio of two units."""
        if self.kind == "clock_offset":
            return max(abs(self.low), abs(self.high)) > DELAY_SHARE * MARGINS_S[-1]
        if self.none != 1.0:
            return False
        limit = max(abs(self.low - 1.0), abs(self.high - 1.0)) > AT_LIMIT * MOST_SCALE
        return limit or any(self.low <= ratio <= self.high for ratio in UNIT_RATIOS)

    @property
    def _off(self) -> float:
        return abs(self.value - self.none)

    @property
    def _half(self) -> float:
        return 0.5 * (self.high - self.low)


def findings(found: Sequence[Estimate], rows: int, profile: Profile) -> list[Finding]:
    """What is notable of a voyage of so many rows, in the contract's words."""
    end = round((rows - 1) * STEP_S, 3)
    return [
        Finding(
            e.kind, e.channel, _sentence(e, profile), start_s=0.0, end_s=end,
            value=round(e.value, 5), low=round(e.low, 5), high=round(e.high, 5), unit=e.unit,
        )
        for e in found
        if e.notable
    ]  # fmt: skip


def _sentence(e: Estimate, profile: Profile) -> str:
    """What a naval engineer reads."""
    scale, digits = {"1": (100.0, 1), "deg/s": (1.0, 3)}.get(e.unit, (1.0, 2))
    off = scale * (e.value - e.none)
    ends = sorted(math.copysign(scale, off) * (end - e.none) for end in (e.low, e.high))
    size = f"{abs(off):.{digits}f}"
    range_ = f"({ends[0]:.{digits}f} to {ends[1]:.{digits}f})"
    more, side = ("more", "starboard") if off > 0 else ("less", "port")
    match e.kind:
        case "clock_offset":
            return _clock_sentence(
                e, f"{size} s {range_} {'after' if off > 0 else 'before'}", profile
            )
        case "yaw_rate_scale":
            return f"The yaw rate shows {size} % {range_} {more} than the heading turns."
        case "yaw_rate_bias":
            return f"The yaw rate shows {size} deg/s {range_} to {side} of what the heading turns."
        case "heading_offset":
            return (
                f"The heading stands {size} deg {range_} to {side} of the axes in which the "
                "velocity agrees with the position."
            )
        case "velocity_scale":
            return f"The velocity shows {size} % {range_} {more} than the position travels."
    along = ("ahead" if off > 0 else "astern") if e.channel.endswith("ahead") else f"to {side}"
    return (
        f"The position is that of a point {size} m {range_} {along} of where the profile has it, "
        "against the velocity."
    )


def _clock_sentence(e: Estimate, when: str, profile: Profile) -> str:
    if e.channel == "gnss":
        return f"Position and velocity come {when} the heading they belong to."
    name = e.channel.replace("_", " ")
    if not e.rival:
        return f"The {name} comes {when} the heading it belongs to."
    body = profile.sensors.kind("velocity") == "body"
    turned = " where the velocities were turned by the heading when recorded"
    return (
        f"The {name} comes {when} the {e.rival} it belongs to; which of the two keeps the "
        f"heading's time they cannot say{turned if body else ''}."
    )
