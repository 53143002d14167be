"""A voyage on its 10 Hz grid while it is being filled, and the faults that only show there.

Faults are marked row by row and reported with their times; the values stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature import frames
from shiplog.nomenclature.channels import Quality
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows import fault_detection, held_values, resampling
from shiplog.voyages.rows.left_out import rows_explained
from shiplog.voyages.samples import derived_motion

STEP_S = resampling.STEP_NS * 1e-9

# A step starts a new segment where no rollout could shrug it off: worth seconds of the ship's
# motion and a tenth of its length, or a heading that is another heading.
JUMP_S = 3.0
JUMP_LENGTHS = 0.1
JUMP_RAD = math.radians(30.0)
UNSEEN_S = 10.0  # a ship of any size holds its rate of turn for a part of that
MOST_STEPS = 2.0  # in which an instrument counts: a difference that rounding alone makes


@dataclass
class VoyageGrid:
    """Times [m] ns, columns [m] SI, marks [m] of channels.Quality, and what was found.

    explained  of a source: times [ns] of values that were left out, with a finding of their own
    """

    times: np.ndarray
    explained: Mapping[str, np.ndarray] = field(default_factory=dict)
    columns: dict[str, np.ndarray] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    marks: np.ndarray = field(init=False)
    unknown: dict[str, np.ndarray] = field(default_factory=dict)  # of a source: rows [m] bool

    def __post_init__(self) -> None:
        self.marks = np.zeros(len(self.times), np.int32)

    @property
    def seconds(self) -> float:
        """From the first row to the last."""
        return float(self.times[-1] - self.times[0]) * 1e-9

    def place(self, name: str, samples: resampling.Samples) -> np.ndarray:
        """A source's values on the grid [m, k]; its gaps, blanks and spikes noted. Of one that is
        too slow throughout, `sampling_findings` says so once."""
        placed = resampling.interpolate_samples(self.times, samples)
        self.unknown[name] = placed.gap | placed.blank | placed.spike
        left_out = self.explained.get(name, self.times[:0])
        said = rows_explained(self.times, samples.time, left_out)
        self.marks[said & (placed.blank | placed.gap)] |= int(Quality.BLANK)
        stood = f", having stood still {_far(name, samples.elsewhere)} away,"
        why = stood if samples.elsewhere else ""
        self.note(placed.blank & ~said, Quality.BLANK, "blank", name, f"is blank{why}")
        self.note(placed.spike, Quality.SPIKE, "spike", name, "spikes")
        if samples.sparse:
            self.marks[placed.gap] |= int(Quality.GAP)
        else:
            self.note(placed.gap & ~said, Quality.GAP, "gap", name, "has no sample")
        return placed.value

    def note(self, mask: np.ndarray, flag: Quality, kind: str, name: str, what: str) -> None:
        """Mark rows [m] bool, and say each stretch of them."""
        rows = list(fault_detection.stretches(mask))
        fault_detection.mark(self.marks, rows, flag)
        self.findings += fault_detection.findings_of(
            kind, name, [fault_detection.seconds(i) for i in rows], what
        )


def mark_gaps(grid: VoyageGrid) -> None:
    """A row that lacks any value is a gap, whichever instrument is silent."""
    missing = np.zeros(len(grid.times), bool)
    for column in grid.columns.values():
        missing |= np.isnan(column)
    known = (grid.marks & int(Quality.GAP | Quality.BLANK)) != 0
    grid.marks[missing & ~known] |= int(Quality.GAP)


def mark_holds(grid: VoyageGrid, profile: Profile, sampled: dict[str, resampling.Samples]) -> None:
    """Values that repeat although the ship moves; frozen ones, too long to be data."""
    over_ground = _ground_velocity(grid)
    for name, samples in sampled.items():
        rows = held_values.find_held(
            name, samples, sampled, grid.times, grid.columns, over_ground, profile
        )
        fault_detection.mark(grid.marks, rows, Quality.HELD)
        for first, last in rows:
            grid.unknown[name][first : last + 1] = True
        intervals = [fault_detection.seconds(i) for i in rows]
        lasted = [end - start for start, end in intervals]
        frozen = [i for i, s in zip(rows, lasted, strict=True) if s > fault_detection.FROZEN_S]
        fault_detection.mark(grid.marks, frozen, Quality.FROZEN)
        long = [
            i
            for i, s in zip(intervals, lasted, strict=True)
            if s >= fault_detection.REPORTED_HELD_S
        ]
        grid.findings += fault_detection.findings_of(
            "held", name, long, "repeats the same value while the ship moves,"
        )
        brief = [s for s in lasted if s < fault_detection.REPORTED_HELD_S]
        if sum(brief) >= fault_detection.REPORTED_HELD_S:
            often = "once" if len(brief) == 1 else f"{len(brief)} times"
            sentence = f"{name} repeats itself briefly, {often}, {sum(brief):.1f} s in all."
            grid.findings.append(
                Finding("held", name, sentence, value=float(len(brief)), unit="times")
            )


def mark_jumps(grid: VoyageGrid, profile: Profile, sampled: dict[str, resampling.Samples]) -> None:
    """Steps of the position or heading that the velocity and the yaw rate do not explain.

    Looked for from one measured value to the next, not between rows that were interpolated.
    """
    over_ground = np.nan_to_num(_ground_velocity(grid))
    position = np.nan_to_num(np.stack((grid.columns["x0"], grid.columns["y0"]), 1))
    found = []
    scale = held_values.METRE if profile.sensors.kind("position") == "geodetic" else 1.0
    of_position = ("position", "velocity", "heading")
    if profile.sensors.velocity is None:  # derived from the position, and torn where it is
        place = sampled["position"].value * scale
        if scale != 1.0 and len(place):  # degrees: those of longitude are shorter
            place = place * (1.0, math.cos(math.radians(float(sampled["position"].value[0, 0]))))
        for row, step in _torn(grid, sampled["position"], place[:, 0] + 1j * place[:, 1], None):
            grid.marks[row] |= int(Quality.JUMP)
            found.append(_jump("position", row, step, "m", math.inf, "the samples around it"))
        steps = []
    else:
        steps = _jumps(grid, sampled, of_position, position, over_ground, scale=scale)
    for row, step in steps:
        lost = _worth(step, over_ground[row])
        if lost > JUMP_S and step > JUMP_LENGTHS * profile.ship.length_m:
            grid.marks[row] |= int(Quality.JUMP)
        found.append(_jump("position", row, step, "m", lost))
    if profile.sensors.yaw_rate is None:  # a derivative is not compared with what it is of
        turns, lasting = _steps(grid, sampled["heading"]), None
        if profile.sensors.velocity is None:
            pointing = sampled["heading"].value[:, 0]
            turns = _torn(grid, sampled["heading"], pointing, 2.0 * math.pi)
    else:
        heading, lasting = (np.nan_to_num(grid.columns[c]) for c in ("heading", "yaw_rate"))
        known = np.isfinite(grid.columns["heading"])
        heading[known] = np.unwrap(heading[known])  # across a gap, not by way of its zeros
        of_heading = ("heading", "yaw_rate")
        full = 2.0 * math.pi
        turns = _jumps(grid, sampled, of_heading, heading[:, None], lasting[:, None], full)
    for row, step in turns:
        if step > JUMP_RAD:
            grid.marks[row] |= int(Quality.JUMP)
        lost = math.inf if lasting is None else _worth(step, lasting[row])
        by = "the samples around it" if lasting is None else "its rate"
        found.append(_jump("heading", row, math.degrees(step), "deg", lost, by))
    grid.findings += found


def _ground_velocity(grid: VoyageGrid) -> np.ndarray:
    """Velocity [m, 2] along x0 and y0; NaN where it or the heading is not known."""
    heading = grid.columns["heading"]
    surge, sway = grid.columns["surge"], grid.columns["sway"]
    return np.stack(frames.in_earth_axes(surge, sway, np.cos(heading), np.sin(heading)), 1)


def _jumps(
    grid: VoyageGrid,
    sampled: Mapping[str, resampling.Samples],
    sources: tuple[str, ...],
    gone: np.ndarray,
    rate: np.ndarray,
    period: float | None = None,
    scale: float = 1.0,
) -> list[tuple[int, float]]:
    """Rows and sizes of the steps of the first of some sources, whose values [m, k] and rates of
    the others these are, in rows in which all of them were measured, whatever else was; but for
    those that are a step in which the instrument counts there, of samples `scale` times as large,
    and those that the ship can have gone while nobody measured.
    """
    samples = sampled[sources[0]]
    usable = ~np.logical_or.reduce([grid.unknown[name] for name in sources])
    usable &= np.isfinite(gone).all(axis=1) & np.isfinite(rate).all(axis=1)
    every = max(round(samples.period_s / STEP_S), 1)
    if every > 1:
        usable &= samples.nearest_rows(grid.times)
    found = fault_detection.jumps(gone, rate, usable, samples.noise, every, period, lively=True)
    found = _not_unseen(found, usable, rate)
    at = np.searchsorted(samples.time, grid.times[[row for row, _ in found]])
    counted = fault_detection.steps_around(samples.value, [(int(i), int(i)) for i in at])
    return [
        one for one, step in zip(found, counted * scale, strict=True) if one[1] > MOST_STEPS * step
    ]


def _not_unseen(
    found: list[tuple[int, float]], usable: np.ndarray, rate: np.ndarray
) -> list[tuple[int, float]]:
    """The steps without those that a ship can have gone since the last usable row [m]: over
    UNSEEN_S its rate was interpolated, and it can have gone to any side as fast as it mostly does.
    """
    if not found:
        return found
    rows = np.flatnonzero(usable)
    mostly = float(np.quantile(np.linalg.norm(rate[usable], axis=1), 0.95))
    kept = []
    for row, step in found:
        before = rows[np.searchsorted(rows, row) - 1] if len(rows) and rows[0] < row else row
        gap = (row - before) * STEP_S
        if gap <= UNSEEN_S or step > 2.0 * gap * mostly:
            kept.append((row, step))
    return kept


def _steps(grid: VoyageGrid, samples: resampling.Samples) -> list[tuple[int, float]]:
    """Rows and sizes of the steps of a heading whose rate nobody measured."""
    sound = ~samples.spike
    time = samples.time[sound]
    found = fault_detection.steps(samples.value[sound, 0], samples.noise, 2.0 * math.pi)
    rows = [(int(np.searchsorted(grid.times, time[at])), step) for at, step in found]
    return [(row, step) for row, step in rows if 0 < row < len(grid.times)]


def _torn(
    grid: VoyageGrid, samples: resampling.Samples, value: np.ndarray, period: float | None
) -> list[tuple[int, float]]:
    """Rows and sizes of the steps of a source whose rate is derived from it, as `derived_motion`
    has them; value [n] of its samples, complex where it is a position."""
    sound = ~samples.spike
    kept = replace(samples, time=samples.time[sound], value=samples.value[sound])
    steps = derived_motion.torn(kept, value[sound], period).items()
    rows = [(int(np.searchsorted(grid.times, kept.time[at])), step) for at, step in steps]
    return sorted((row, step) for row, step in rows if 0 < row < len(grid.times))


def _far(name: str, size: float) -> str:
    """How far off a reading was, in words."""
    if name == "position":
        return f"{size / 1000.0:.0f} km" if size > 10_000.0 else f"{size:.3g} m"
    if name in ("velocity", "wind"):
        return f"{size:.3g} m/s"
    return f"{math.degrees(size):.3g} deg" + ("/s" if name == "yaw_rate" else "")


def _worth(step: float, rate: np.ndarray | float) -> float:
    """Seconds of the motion that a step stands for."""
    speed = float(np.linalg.norm(rate))
    return step / speed if speed > 0 else math.inf


def _jump(
    name: str, row: int, size: float, unit: str, lost: float, by: str = "its rate"
) -> Finding:
    at = round(row * STEP_S, 3)
    worth = f", as if {lost:.1f} s were missing" if lost < 60.0 else ""
    verb = "say" if by.startswith("the ") else "says"
    sentence = f"{name} steps {size:.3g} {unit} beyond what {by} {verb} at {at:.1f} s{worth}."
    return Finding("jump", name, sentence, start_s=at, end_s=at, value=round(size, 6), unit=unit)
