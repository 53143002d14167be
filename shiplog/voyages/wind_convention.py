"""Whether the apparent wind is measured as the profile says: the wind over ground does not turn
with the ship.

With A the apparent wind in body axes (where it comes from), R(ψ) the turn to earth axes and V the
velocity over ground, the wind over ground is

    W = R(ψ) A - V

and within a few minutes it keeps its direction, whatever the ship does. Under another convention,
such as a mirrored vane, W turns with the ship. So each convention is tried, and the one whose W
varies least is the log's. The ship's own speed gives the unit: R(ψ) A = W + β V, with β = 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog import frames
from shiplog.channels import UNUSABLE
from shiplog.logs.health_report import Finding
from shiplog.numbers import figure
from shiplog.profile import Profile
from shiplog.voyages.resampling import RATE_HZ

BLOCK_S = 200.0  # s over which a wind keeps its direction
SLOPE_BLOCKS = 4  # of them, fewer of which give no standard error of β
SPREAD = 0.8  # mean resultant of the headings of a block, above which it tells nothing
LEAST_WIND = 0.5  # m/s of apparent wind, below which an anemometer stands
RATIO = 8.0  # times the variance of the best convention, from which it is another one: 9 to 24 of
# a sound vane that is read otherwise, on twelve sample voyages
ALIKE = 1.5  # ratio of variances of two conventions, up to which the simpler one is said
SURE, LEAST_SLOPE = 3.0, 0.3  # standard errors, and β itself, by which it is beyond zero
SCATTER = 0.3  # share of the apparent wind, by which W varies at least under a wrong convention
COURSE = 0.5  # mean cosine of course and heading, below which the heading itself is in doubt
COURSE_S = 5.0  # s over which a course is taken from the position
STEP_M = 0.5  # m of way over that time, below which there is no course

Turn = Callable[[np.ndarray], np.ndarray]
TOWARDS = "the direction that it blows towards"
CONVENTIONS: dict[str, tuple[Turn, str]] = {
    "mirrored, port for starboard": (
        lambda a: a * np.array([1.0, -1.0]), "sensors.wind.sign = [1.0, -1.0]"
    ),
    TOWARDS: (
        lambda a: -a, "sensors.wind.offset = [0.0, 180.0], in its unit"
    ),
    "mirrored, and the direction that it blows towards": (
        lambda a: a * np.array([-1.0, 1.0]), "sensors.wind.sign and sensors.wind.offset"
    ),
}  # fmt: skip
NORTH = "counted from north, and not from the bow"


def findings(table: pl.DataFrame, profile: Profile) -> list[Finding]:
    """A wind whose direction contradicts heading and motion; one finding, or none.

    table   10 Hz: the profile's columns, SI, and quality
    """
    if not profile.has_wind:
        return []
    found = _measured(table)
    if found is None:
        return []
    least = min(found.ratios.values())
    words = next(name for name, ratio in found.ratios.items() if ratio <= ALIKE * least)
    times = math.sqrt(1.0 / max(found.ratios[words], 1e-9))
    if times**2 >= RATIO and found.scatter >= SCATTER:
        said = (
            f"The wind over ground turns with the ship: as the profile reads it, it varies "
            f"{figure(times, 2)} times as much as with the wind's angle taken as {words}"
        )
    elif found.reversed_:
        words, times = TOWARDS, found.slope
        said = (
            "The apparent wind turns round where the ship turns round: it grows by "
            f"{figure(found.slope, 2)} m/s ahead for each m/s of speed, and not by 1, as if its "
            f"angle were {words}"
        )
    else:
        return []
    key = CONVENTIONS[words][1] if words in CONVENTIONS else "sensors.wind"
    end = round((table.height - 1) / RATE_HZ, 3)
    if words == NORTH:  # or a vane that is stuck: a question
        said += ", or the vane is stuck"
        return [
            Finding("implausible", "wind", f"{said}. Look at {key}.", 0.0, end, times, unit="1")
        ]
    return [
        Finding(
            "contradiction", "wind", f"{said}. Look at {key}.", start_s=0.0, end_s=end,
            value=times, unit="1", reason="sign",
        )
    ]  # fmt: skip


@dataclass(frozen=True)
class _Measured:
    """ratios   convention → variance of W under it over that as the profile reads it
    scatter   standard deviation of the latter over the apparent wind speed
    slope     β as the profile reads the wind, and its standard error
    blocks    of wind
    """

    ratios: dict[str, float]
    scatter: float
    slope: float
    error: float
    blocks: int

    @property
    def reversed_(self) -> bool:
        """Whether β is certainly negative."""
        sure = self.slope + SURE * self.error < -LEAST_SLOPE
        return self.blocks >= SLOPE_BLOCKS and sure


def _measured(table: pl.DataFrame) -> _Measured | None:
    """None where nothing can be compared."""
    good = (table["quality"].to_numpy() & int(UNUSABLE)) == 0
    names = ("x0", "y0", "heading", "surge", "sway", "wind_speed", "wind_angle")
    columns = {n: table[n].cast(pl.Float64).fill_null(np.nan).to_numpy() for n in names}
    for values in columns.values():
        good &= np.isfinite(values)
    if not good.any() or not _ahead(columns, good):
        return None
    psi, speed, angle = columns["heading"], columns["wind_speed"], columns["wind_angle"]
    apparent = np.stack((speed * np.cos(angle), speed * np.sin(angle)), -1)
    velocity = _turned(psi, np.stack((columns["surge"], columns["sway"]), -1))
    tried = {name: _turned(psi, turn(apparent)) - velocity for name, (turn, _) in
             CONVENTIONS.items()}  # fmt: skip
    tried[NORTH] = apparent - velocity
    tried[""] = _turned(psi, apparent) - velocity
    size = round(BLOCK_S * RATE_HZ)
    sums, blown, slopes = dict.fromkeys(tried, 0.0), 0.0, []
    for begin in range(0, len(good), size):
        rows = slice(begin, begin + size)
        kept = good[rows]
        if 2 * kept.sum() < size or float(speed[rows][kept].mean()) < LEAST_WIND:
            continue
        if abs(np.exp(1j * psi[rows][kept]).mean()) > SPREAD:
            continue
        for name, wind in tried.items():
            sums[name] += float(wind[rows][kept].var(0).sum())
        blown += float((speed[rows][kept] ** 2).mean())
        moved = velocity[rows][kept] - velocity[rows][kept].mean(0)
        felt = (tried[""] + velocity)[rows][kept]
        slopes.append((float((moved * felt).sum()), float((moved**2).sum())))
    if not slopes:
        return None
    own = sums.pop("")
    ratios = {name: value / max(own, 1e-12) for name, value in sums.items()}
    products, squares = np.array(slopes).T
    slope = products.sum() / max(squares.sum(), 1e-12)
    error = math.sqrt(((products - slope * squares) ** 2).sum()) / max(squares.sum(), 1e-12)
    return _Measured(ratios, math.sqrt(own / blown), float(slope), error, len(slopes))


def _turned(heading: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """R(ψ) times body vectors [n, 2]."""
    c, s = np.cos(heading), np.sin(heading)
    return np.stack(frames.in_earth_axes(vector[:, 0], vector[:, 1], c, s), axis=-1)


def _ahead(columns: dict[str, np.ndarray], good: np.ndarray) -> bool:
    """Whether the course of the positions agrees with the heading: if it does not, the heading is
    in doubt, and says nothing of the wind. True where the ship makes no way."""
    step = round(COURSE_S * RATE_HZ)
    if len(good) <= step:
        return False
    north = columns["x0"][step:] - columns["x0"][:-step]
    east = columns["y0"][step:] - columns["y0"][:-step]
    kept = good[step:] & good[:-step] & (np.hypot(north, east) > STEP_M)
    if kept.sum() < step:
        return True
    course = np.arctan2(east, north)[kept]
    return (
        float(np.cos(course - columns["heading"][step // 2 : -step + step // 2][kept]).mean())
        > COURSE
    )
