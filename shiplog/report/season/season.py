"""The result of `shiplog trend`: each cause voyage by voyage, the speed loss, limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from shiplog.diagnosis.hypotheses.hypothesis import name_of
from shiplog.diagnosis.onset.drift import Slope
from shiplog.diagnosis.season.speed_loss import SpeedLoss
from shiplog.diagnosis.season.trends import Event, Limit, OfVoyage, Trend
from shiplog.exceptions import listed
from shiplog.models.causes import ParameterEstimate
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted, figure
from shiplog.report.diagnosis.sections.written import as_json
from shiplog.report.evaluation.text_table import table
from shiplog.report.figures.bars import spoken
from shiplog.report.result import Shown, Shows

NO_CAUSE = (
    "No cause is named on these voyages, and none was asked for with --of: only the speed loss is "
    "followed."
)

UNDATED = (
    "Not every voyage has a date: there is no slope, no event and no limit, and voyages stand in "
    "the order of their recorded time."
)


@dataclass(frozen=True, repr=False)
class Season(Shows):
    """Each cause's size voyage by voyage, and the ship's speed loss.

    run       the model that the voyages are compared with
    ship      its name
    voyages   in the order of their start
    dates     voyage → its start; without those whose recorder knows no date
    trends    of each cause that is followed
    losses    voyage → speed loss at equal revolutions
    notes     sentences on what was not done, and why
    shown     its pictures and its page
    """

    run: str
    ship: str
    voyages: tuple[str, ...]
    dates: Mapping[str, datetime]
    trends: tuple[Trend, ...]
    losses: Mapping[str, SpeedLoss]
    notes: tuple[str, ...] = ()
    shown: Shown | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        followed = ", ".join(one.label for one in self.trends) or "no cause"
        return f"Season({self.run}: {followed} over {counted(len(self.voyages), 'voyage')})"

    @property
    def lines(self) -> list[str]:
        found = [f"# {self.ship}, {counted(len(self.voyages), 'voyage')} against {self.run}", ""]
        for trend in self.trends:
            found += [f"## {spoken(trend.label)}", "", _sizes(trend), "", *sentences(trend), ""]
        found += ["## Speed loss at equal revolutions", "", self._loss_table(), ""]
        return [*found, *self.notes]

    @property
    def json(self) -> dict:
        return {
            "contract": CONTRACT, "run": self.run, "ship": self.ship,
            "voyages": [self._voyage(name) for name in self.voyages],
            "causes": [_trend(one) for one in self.trends], "notes": list(self.notes),
        }  # fmt: skip

    def _voyage(self, name: str) -> dict[str, Any]:
        date = self.dates.get(name)
        found = {"voyage": name, "start": None if date is None else date.isoformat()}
        return found | {"speed_loss": as_json(self.losses[name])}

    def _loss_table(self) -> str:
        rows = []
        for name in self.voyages:
            one = self.losses[name]
            out = ", ".join(f"{why} {count}" for why, count in one.left_out.items()) or "-"
            rows.append((name, day(self.dates.get(name)), *loss_cells(one), one.blocks, out))
        head = ("voyage", "date", "speed loss [%]", "90 % interval", "blocks", "left out")
        return table(head, rows, ("speed loss [%]", "blocks"))


def loss_cells(one: SpeedLoss) -> tuple[str, str]:
    value = "-" if one.value is None else f"{one.value:+.1f}"
    if one.low is None or one.high is None:
        return value, "-"
    return value, f"{one.low:+.1f} to {one.high:+.1f}"


def day(date: datetime | None) -> str:
    return "-" if date is None else date.date().isoformat()


def _sizes(trend: Trend) -> str:
    """A row a voyage and parameter: pooled, and without pooling."""
    rows = []
    for one in trend.voyages:
        for name, size in one.pooled.items():
            alone = one.alone[name]
            speed = "-" if one.speed is None else f"{one.speed.value:+.1f}"
            rows.append((
                one.voyage, day(one.date), name.replace("_", " "), figure(size.value, 3),
                _between(size), _between(alone), size.unit, speed,
            ))  # fmt: skip
    head = ("voyage", "date", "parameter", "value", "90 % interval", "without pooling", "unit",
            "calm speed [%]")  # fmt: skip
    return table(head, rows, ("value", "calm speed [%]"))


def _between(one: ParameterEstimate) -> str:
    return f"{figure(one.low, 3)} to {figure(one.high, 3)}"


def sentences(trend: Trend) -> list[str]:
    """Spread, slope, events and limit in words."""
    found = []
    if (spread := trend.spread) is not None:
        found.append(
            f"From voyage to voyage it varies by {figure(100.0 * spread.value, 2)} % of its "
            f"realistic size (90 %: {figure(100.0 * spread.low, 2)} to "
            f"{figure(100.0 * spread.high, 2)} %)."
        )
    if (slope := trend.slope) is not None:
        found.append(
            f"Change of its {slope.parameter}: {figure(slope.value, 3)} a day (90 %: "
            f"{figure(slope.low, 3)} to {figure(slope.high, 3)}), over {figure(slope.days, 3)} "
            "days."
        )
    found += [_event(one) for one in trend.events]
    return found + ([] if trend.limit is None else [limit_words(trend.limit)])


def _event(one: Event) -> str:
    parts = [
        f"{name.replace('_', ' ')} {figure(before.value, 3)} before ({_between(before)}) and "
        f"{figure(one.after[name].value, 3)} after ({_between(one.after[name])})"
        for name, before in one.before.items()
    ]
    return f"Event of {day(one.date)}: {'; '.join(parts)}."


def limit_words(one: Limit) -> str:
    name = f"{one.parameter.replace('_', ' ')} of {figure(one.limit, 3)}"
    if one.passed >= 0.5:
        return f"The limit, a {name}, is passed already (probability {one.passed:.2f})."
    if one.value is None:
        return (
            f"The limit, a {name}, is not passed within ten years (probability {1 - one.ever:.2f})."
        )
    high = "later than in ten years" if one.high is None else day(one.high)
    return (
        f"The limit, a {name}, is passed on {day(one.value)} (90 %: {day(one.low)} to {high}), "
        "if it goes on like this."
    )


def summary(season: Season) -> str:
    """The claim of a page: what is followed, and how large it was last."""
    over = counted(len(season.voyages), "voyage")
    if not season.trends:
        return f"{season.ship}: no cause is followed over {over}."
    return f"{season.ship}, {over}: {'; '.join(_last(one) for one in season.trends)}."


def _last(trend: Trend) -> str:
    """The sizes of the last voyage."""
    if not trend.voyages:
        return spoken(trend.label)
    last = trend.voyages[-1]
    sizes = listed(
        f"{name.replace('_', ' ')} {figure(one.value, 3)}"
        f"{'' if one.unit == '1' else f' {one.unit}'} ({_between(one)})"
        for name, one in last.pooled.items()
    )
    return f"{spoken(trend.label)} on {last.voyage}: {sizes}"


# --- JSON -----------------------------------------------------------------------------------------


def _trend(one: Trend) -> dict[str, Any]:
    found: dict[str, Any] = {"name": name_of(one.label), "label": one.label}
    found["voyages"] = [_of_voyage(v) for v in one.voyages]
    if one.spread is not None:
        found["spread"] = as_json(one.spread)
    if one.slope is not None:
        found["slope"] = _slope(one.slope)
    found["events"] = [
        {"date": e.date.isoformat(), "before": as_json(e.before), "after": as_json(e.after),
         "change": as_json(e.change)} for e in one.events
    ]  # fmt: skip
    if (limit := one.limit) is not None:
        dates = {k: _iso(getattr(limit, k)) for k in ("low", "value", "high")}
        found["limit"] = {
            "parameter": limit.parameter, "limit": limit.limit, "unit": limit.unit,
            "date": dates, "passed": limit.passed, "within_ten_years": limit.ever,
        }  # fmt: skip
    return found


def _of_voyage(one: OfVoyage) -> dict[str, Any]:
    found = {
        "voyage": one.voyage, "date": _iso(one.date), "parameters": as_json(one.pooled),
        "alone": as_json(one.alone),
    }  # fmt: skip
    return found | ({} if one.speed is None else {"calm_speed_change": as_json(one.speed)})


def _slope(one: Slope) -> dict[str, Any]:
    return as_json(one)


def _iso(date: datetime | None) -> str | None:
    return None if date is None else date.isoformat()
