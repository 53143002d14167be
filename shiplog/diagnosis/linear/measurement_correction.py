"""Causes that change what is read: O = ∂y/∂θ of the measurement and ∂u/∂θ of what drives the ship.

Central differences of the record as it is read with a cause's number q more and less by a step
h (READ_STEP of its realistic size), within the number's bounds:

    ∂u/∂q ≈ (u(q + h) - u(q - h)) / 2h,   ∂y/∂q ≈ (y(q + h) - y(q - h)) / 2h

Causes read one after the other, in the catalogue's order, each what the one before it has made.
Those that change nothing of what a number changes are passed over: the difference is the same
without them.
A number changes few of the things that drive a ship: ∂u/∂q is kept as the series that are not zero
(`Moved`).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from shiplog.diagnosis.linear import segments
from shiplog.diagnosis.linear.parameter_layout import Columns
from shiplog.diagnosis.linear.segments import Cut
from shiplog.machine.arrays import double
from shiplog.models.causes import Cause, Setting
from shiplog.models.extended import Extended
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows.recording import Record

AVERAGING_S = 2.0  # s: a clock's column is a derivative, and its noise would pass for what it tells
# Of a cause's size, to see how it changes what is read: less, and noise drowns a delay
READ_STEP = 0.3


@dataclass(frozen=True)
class Moved:
    """∂u/∂q [S, K, D, Q], how what drives the ship changes with the causes' numbers: the series
    that are not zero, which are few.

    shape   (S, K, D, Q)
    pairs   [n, 2] int32: what drives d and number q of each series, in order; each pair once
    series  [S, n, K] at the instants of the steps
    """

    shape: tuple[int, int, int, int]
    pairs: np.ndarray
    series: np.ndarray

    @classmethod
    def of(cls, shape: tuple[int, ...], series: Mapping[tuple[int, int], np.ndarray]) -> Moved:
        """Of the series [S, K] of some pairs (d, q), without those that are zero everywhere."""
        count, instants, driving, numbers = shape
        kept = sorted(pair for pair, values in series.items() if values.any())
        stacked = np.empty((count, len(kept), instants))
        for i, pair in enumerate(kept):
            stacked[:, i] = series[pair]
        pairs = np.array(kept, np.int32).reshape(-1, 2)
        return cls((count, instants, driving, numbers), pairs, stacked)

    @classmethod
    def none(cls, cut: Cut) -> Moved:
        """Of causes without any number."""
        return cls.of((*cut.driven.shape, 0), {})

    def dense(self, part: slice = slice(None)) -> np.ndarray:
        """∂u/∂q [S, K, D, Q] of a part of the segments, with its zeros."""
        series = self.series[part]
        whole = np.zeros((len(series), *self.shape[1:]))
        for i, (d, q) in enumerate(self.pairs):
            whole[:, :, d, q] = series[:, i]
        return whole


def corrected(causes: Sequence[Cause], record: Record, numbers: Mapping[str, np.ndarray]) -> Record:
    """r_Q(… r₂(r₁(record))): the record as those causes' numbers [SI] have it, in the catalogue's
    order; a cause without numbers, or with zeros, changes nothing."""
    for cause in causes:
        values = numbers.get(cause.label)
        if values is not None and np.any(values != 0.0):
            record = cause.read(record, values)
    return record


def factors(causes: Sequence[Cause], numbers: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Family of the discrepancy → factor Π_causes s [3] (1) of X, Y and N that depend on its
    inputs: the product over causes, label → numbers, SI, of what each `scales`."""
    found: dict[str, np.ndarray] = {}
    for cause in causes:
        if (values := numbers.get(cause.label)) is None or not np.any(values != 0.0):
            continue
        for family, factor in cause.scales(np.asarray(values)).items():
            found[family] = found.get(family, np.ones(3)) * factor
    return found


def water(causes: Sequence[Cause], numbers: Mapping[str, np.ndarray]) -> np.ndarray:
    """V = Σ_causes V(q) [2]: velocity of the water along x₀ and y₀ [m/s], label → numbers, SI."""
    found = np.zeros(2)
    for cause in causes:
        if (values := numbers.get(cause.label)) is None:
            continue
        with double():
            if (moving := cause.water(np.asarray(values))) is not None:
                found += np.asarray(moving, dtype=float)
    return found


def as_hypothesised(cut: Cut, causes: Sequence[Cause], numbers: Mapping[str, np.ndarray]) -> Cut:
    """The segments with what the causes' numbers do to size and inputs of the discrepancy."""
    return replace(cut, factors=factors(causes, numbers), water=water(causes, numbers))


@dataclass
class ActuatorColumns:
    """Columns of causes that act by orders alone, of one record and its segments. They depend on
    the numbers of causes on the same actuators: a sensor's clock leaves them as they were.

    series  number q → label and numbers of those causes, and (d, q) → ∂u_d/∂q [S, K]
    """

    series: dict[int, tuple[tuple, dict[tuple[int, int], np.ndarray]]] = field(default_factory=dict)

    def of(self, column: int, others: tuple) -> dict[tuple[int, int], np.ndarray] | None:
        """A column that was worked out with these numbers; None where it was not."""
        with_others, series = self.series.get(column, (None, {}))
        return series if with_others == others else None


def read(
    model: Extended,
    setting: Setting,
    record: Record,
    rows: np.ndarray,
    numbers: Mapping[str, np.ndarray] | None = None,
    kept: ActuatorColumns | None = None,
) -> tuple[Cut, Moved, np.ndarray]:
    """Segments as read with `numbers` (label → q, SI), ∂u/∂q [S, K, D, Q] and O = ∂y/∂q
    [S, B, 6, Q] there, zero for causes that change no reading. Those of a clock are of the motion
    averaged over AVERAGING_S, since the noise of a derivative says nothing of a clock.

    kept   of the same record and segments, from one reading to the next
    """
    given = dict(numbers or {})
    kept = ActuatorColumns() if kept is None else kept
    sizes = {c.label: c.sizes(setting) for c in model.causes}
    columns = Columns(0, model.causes, np.concatenate([*sizes.values(), np.zeros(0)]))
    steps = [record]  # as read by each cause and those before it
    for cause in model.causes:
        steps.append(corrected((cause,), steps[-1], given))
    base = as_hypothesised(segments.cut(steps[-1], rows), model.causes, given)
    changed = [_apart(one, two) for one, two in itertools.pairwise(steps)]
    acting = [c for c, of in zip(model.causes, changed, strict=True) if "actuator" in of]
    shape = (*base.driven.shape, len(columns.unit))
    moved: dict[tuple[int, int], np.ndarray] = {}  # (d, q) → its series
    observed = np.zeros((*base.y.shape, len(columns.unit)))
    averaged, of = record, None  # a record averaged, which several clocks share
    for place, cause in enumerate(model.causes):
        if not cause.reads:
            continue
        before = steps[place]
        here = np.asarray(given.get(cause.label, np.zeros(cause.count)))
        low, high = cause.bounds(setting)
        if cause.shifts and of is not before:
            averaged, of = before.smoothed(AVERAGING_S), before
        moving = averaged if cause.shifts else before
        near = [c for c in acting if _share_orders(cause, c, record.profile)]
        # those of a cause that may act by anything that was recorded are not kept
        alone = all(c.orders(record.profile) is not None for c in (cause, *near))
        others = (*((c.label, np.asarray(given[c.label]).tobytes()) for c in near), here.tobytes())
        for i, column in enumerate(columns.indices[cause.label].tolist()):
            if alone and (series := kept.of(column, others)) is not None:
                moved |= series
                continue
            step = np.zeros(cause.count)
            absent = cause.first_step if here[i] == 0.0 else 0.0
            step[i] = (absent or READ_STEP) * sizes[cause.label][i]
            # not beyond what it may be: a lag that is negative sharpens steps and noise
            ends = np.minimum(here + step, high), np.maximum(here - step, low)
            apart = ends[0][i] - ends[1][i]
            more, less = (cause.read(moving, end) for end in ends)
            felt = _felt(_apart(more, less))
            later = [
                c for c, of in zip(model.causes[place + 1 :], changed[place + 1 :], strict=True)
                if (of & felt and (felt != {"actuator"} or c in near)) or (felt and c.user)
            ]  # fmt: skip
            more, less = (corrected(later, one, given) for one in (more, less))
            differ = _apart(more, less)  # of what both share nothing changes
            found: dict[tuple[int, int], np.ndarray] = {}
            if "actuator" in differ:
                change = more.actuator - less.actuator
                units = np.flatnonzero(change.any(0))
                change = segments.average_at_instants(record, rows, change[:, units])
                found |= {(d, column): change[..., k] / apart for k, d in enumerate(units.tolist())}
            if differ & {"wind", "state"}:
                change = segments.average_at_instants(record, rows, more.true_wind - less.true_wind)
                for d, values in enumerate(np.moveaxis(change, -1, 0), shape[2] - 2):
                    found[d, column] = values / apart
            if "state" in differ:
                between = replace(more, state=more.state - less.state)
                observed[..., column] = segments.means_of_bins(between, rows) / apart
            if alone:
                kept.series[column] = others, found
            moved |= found
    return base, Moved.of(shape, moved), observed


def _apart(one: Record, other: Record) -> frozenset[str]:
    """What two records do not share."""
    return frozenset(
        name for name in ("state", "actuator", "wind")
        if getattr(one, name) is not getattr(other, name)
    )  # fmt: skip


def _share_orders(one: Cause, other: Cause, profile: Profile) -> bool:
    """Whether two causes may act on the same actuators."""
    own, others = one.orders(profile), other.orders(profile)
    return own is None or others is None or bool(own & others)


def _felt(differ: frozenset[str]) -> frozenset[str]:
    """What a difference is felt through: the true wind is worked out from wind and motion."""
    return differ | {"wind", "state"} if differ & {"wind", "state"} else differ
