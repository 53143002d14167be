"""The page of a season."""

from __future__ import annotations

from importlib.metadata import version

from shiplog.diagnosis.season.trends import Trend
from shiplog.models.causes import ParameterEstimate
from shiplog.report.diagnosis.sections.subject import dates
from shiplog.report.figures.bars import spoken
from shiplog.report.page.blocks import (
    Block,
    Fold,
    Gallery,
    Grid,
    Items,
    Line,
    Page,
    Paragraph,
    Section,
    number,
)
from shiplog.report.season import drawing
from shiplog.report.season.season import Season, day, loss_cells, sentences, summary

TERMS = (
    "pooled: partial pooling. Voyages of one season are alike to a degree that the data say; one "
    "that says little is drawn towards the others (Gelman et al. 2013, Sec. 5.4).",
    "without pooling: the same likelihood, each voyage with a size of its own.",
    "calm speed: what the size changes of the model's steady speed ahead at the trial's mean "
    "revolutions, without wind.",
    "speed loss: measured speed through the water over that of the model at the same revolutions "
    "and in the same wind, less one; below zero is slower. Block averages, filtered for wind, "
    "depth, rudder, steadiness and outliers in the sense of ISO 19030-2:2016; block length and "
    "wind limit of a ship shorter than 100 m are scaled by Froude's law.",
    "limit: the date at which the trend passes it, if it goes on as it did.",
)


def of_season(season: Season) -> Page:
    starts = [one.isoformat() for one in season.dates.values()]
    when = f" · {dates(starts)}" if starts else ""
    drawn = list(drawing.pictures(season))
    sections = [
        Section(f"cause-{i}", spoken(trend.label).capitalize(), _cause(trend, [
            picture for of, _, picture in drawn if of is trend
        ]))
        for i, trend in enumerate(season.trends)
    ]  # fmt: skip
    losses = [picture for of, _, picture in drawn if of is None]
    sections.append(Section("speed", "Speed loss at equal revolutions", _loss(season, losses)))
    notes: list[Block] = [Items([[note] for note in season.notes])] if season.notes else []
    notes.append(Items([[text] for text in TERMS]))
    sections.append(Section("terms", "Terms and notes", notes))
    word, tone = ("followed", "found") if season.trends else ("no cause named", "open")
    return Page(
        title=f"{season.ship}: season",
        kicker=f"{season.ship} · model {season.run}{when} · shiplog {version('shiplog')}",
        word=word, tone=tone, claim=summary(season), sections=sections,
    )  # fmt: skip


def _cause(trend: Trend, drawn: list) -> list[Block]:
    found: list[Block] = [Gallery(drawn)] if drawn else []
    found += [Paragraph([text]) for text in sentences(trend)]
    rows = []
    for one in trend.voyages:
        for name, size in one.pooled.items():
            speed: Line = ["-"] if one.speed is None else [number(one.speed.value, "%", 2)]
            rows.append((
                [one.voyage], [day(one.date)], [name.replace("_", " ")],
                [number(size.value, _unit(size))], _ends(size), _ends(one.alone[name]), speed,
            ))  # fmt: skip
    head = ("voyage", "date", "parameter", "value", "90 % interval", "without pooling",
            "calm speed")  # fmt: skip
    found.append(Fold("Voyage by voyage", [Grid(head, rows, ("value", "calm speed"))]))
    return found


def _unit(size: ParameterEstimate) -> str:
    return "" if size.unit == "1" else size.unit


def _ends(size: ParameterEstimate) -> Line:
    return [number(size.low, _unit(size)), " to ", number(size.high, _unit(size))]


def _loss(season: Season, drawn: list) -> list[Block]:
    found: list[Block] = [Gallery(drawn)] if drawn else []
    rows = []
    for name in season.voyages:
        one = season.losses[name]
        value, ends = loss_cells(one)
        out = ", ".join(f"{why} {count}" for why, count in one.left_out.items()) or "-"
        rows.append((
            [name], [day(season.dates.get(name))], [value], [ends], [str(one.blocks)], [out],
        ))  # fmt: skip
    head = ("voyage", "date", "speed loss [%]", "90 % interval", "blocks", "blocks left out")
    return [*found, Grid(head, rows, ("speed loss [%]", "blocks"))]
