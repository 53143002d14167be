"""A season's text, JSON, page and pictures, with and without dates."""

import json
from datetime import UTC, datetime, timedelta

import pytest

from shiplog.diagnosis.onset.drift import Slope
from shiplog.diagnosis.season.speed_loss import SpeedLoss
from shiplog.diagnosis.season.trends import Event, Limit, OfVoyage, Trend
from shiplog.models.causes import Fouling, ParameterEstimate
from shiplog.report.page import html
from shiplog.report.season import drawing, page
from shiplog.report.season.season import NO_CAUSE, Season, limit_words

BEGAN = datetime(2026, 3, 1, 8, tzinfo=UTC)
STRANGE = "a|<script>"


def size(value: float, spread: float = 0.1) -> ParameterEstimate:
    return ParameterEstimate(value, value - spread, value + spread, "1")


def season(apart: timedelta | None, trends: bool = True) -> Season:
    names = ("out", "home", STRANGE)
    dates = {} if apart is None else {n: BEGAN + i * apart for i, n in enumerate(names)}
    voyages = tuple(
        OfVoyage(n, dates.get(n), {"factor": size(1.1 + 0.1 * i)}, {"factor": size(1.1, 0.3)},
                 size(-4.0 - i))
        for i, n in enumerate(names)
    )  # fmt: skip
    event = Event(
        BEGAN, {"factor": size(1.5)}, {"factor": size(1.0)}, {"factor": size(-0.5)}
    )  # fmt: skip
    limit = Limit("factor", 1.4, "1", BEGAN, BEGAN + timedelta(days=90), None, 0.1, 0.8)
    trend = Trend(
        "fouling", Fouling(), voyages, size(0.12, 0.05),
        Slope("factor", 0.002, 0.001, 0.003, "1/day", 60.0), (event,), limit,
    )  # fmt: skip
    losses = {
        "out": SpeedLoss(-3.0, -3.5, -2.5, 4, {"rudder above 5 deg": 2}),
        "home": SpeedLoss(-4.0, None, None, 1, {}), STRANGE: SpeedLoss(None, None, None, 0, {}),
    }  # fmt: skip
    followed = (trend,) if trends else ()
    return Season("mmg", "a ship", names, dates, followed, losses, () if trends else (NO_CAUSE,))


@pytest.mark.parametrize("apart", [None, timedelta(hours=3), timedelta(days=40)], ids=str)
def test_the_page_has_a_picture_of_each_parameter_and_of_the_speed_loss(apart):
    of = season(apart)
    drawn = list(drawing.pictures(of))
    assert [(trend.label if trend else None, name) for trend, name, _ in drawn] == [
        ("fouling", "factor"), (None, ""),
    ]  # fmt: skip
    text = html.render(page.of_season(of))
    assert text.count("<svg") == 2
    assert "<script>" not in text.replace("&lt;script&gt;", "")  # names of strangers are inert
    assert "a ship, 3 voyages: fouling on a|&lt;script&gt;: factor 1.3 (1.2 to 1.4)" in text


def test_the_text_says_slope_event_and_limit():
    text = season(timedelta(days=40)).text
    assert "Change of its factor: 0.002 a day (90 %: 0.001 to 0.003), over 60 days." in text
    assert "factor 1.5 before (1.4 to 1.6) and 1 after (0.9 to 1.1)" in text
    assert (
        "is passed on 2026-05-30 (90 %: 2026-03-01 to later than in ten years), if it goes on"
    ) in text
    assert "| out" in text and "-3.5 to -2.5" in text and "rudder above 5 deg 2" in text


@pytest.mark.parametrize(
    ("value", "passed", "words"),
    [(None, 0.0, "is not passed within ten years (probability 0.60)"),
     (BEGAN, 0.9, "is passed already (probability 0.90)")],
)  # fmt: skip
def test_a_limit_may_be_passed_or_never(value, passed, words):
    assert words in limit_words(Limit("factor", 1.4, "1", None, value, None, passed, 0.4))


def test_json_is_whole_without_dates():
    found = json.loads(json.dumps(season(None).json))
    assert found["contract"] == 1
    assert [v["start"] for v in found["voyages"]] == [None, None, None]
    (cause,) = found["causes"]
    assert cause["voyages"][1]["parameters"]["factor"]["value"] == pytest.approx(1.2)
    assert cause["voyages"][0]["calm_speed_change"]["value"] == -4.0
    assert cause["limit"]["date"]["high"] is None
    assert found["voyages"][0]["speed_loss"] == {
        "value": -3.0, "low": -3.5, "high": -2.5, "blocks": 4,
        "left_out": {"rudder above 5 deg": 2},
    }  # fmt: skip


def test_without_a_cause_it_says_so():
    of = season(timedelta(days=40), trends=False)
    assert NO_CAUSE in of.text
    assert "no cause is followed over 3 voyages" in html.render(page.of_season(of))
