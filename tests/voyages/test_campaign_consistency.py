"""Several voyages tell what one cannot: sensors of a campaign, with a fault written into them."""

from dataclasses import replace

import numpy as np
import pytest
import sailing

from shiplog.commands import sensors
from shiplog.voyages.contradictions import gross as contradictions
from shiplog.voyages.contradictions.gross import Contradictions
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.sensors import campaign_consistency, sensor_consistency
from shiplog.voyages.sensors.campaign_consistency import campaign, deviates, join, seasons
from shiplog.voyages.sensors.sensor_findings import Estimate
from shiplog.voyages.store.store import Store

DAY = 86_400.0


def motion(seed: int, seconds: float, late: float = 0.0) -> sensor_consistency.Motion:
    """Turns to either side, the yaw rate so much after the heading, with noise of a cheap gyro."""
    rng = np.random.default_rng(seed)
    t = 0.1 * np.arange(round(seconds / 0.1))
    phase, period = rng.uniform(0.0, 6.0), rng.uniform(25.0, 40.0)

    def heading(at):
        return 0.4 * np.sin(2.0 * np.pi * at / period + phase) + 0.02 * at

    rate = np.gradient(heading(t - late), 0.1)
    speed = np.full(len(t), 0.5)
    c, s = np.cos(heading(t)), np.sin(heading(t))
    gone = np.cumsum(np.stack((c, s), 1) * 0.05, axis=0)
    return sensor_consistency.Motion(
        np.arange(len(t)) == 0,
        heading(t) + 2e-3 * rng.standard_normal(len(t)),
        rate + 6e-3 * rng.standard_normal(len(t)),
        gone + 0.01 * rng.standard_normal(gone.shape),
        np.stack((speed, np.zeros(len(t))), 1) + 0.005 * rng.standard_normal((len(t), 2)),
    )


@pytest.fixture
def of(monkeypatch):
    """A campaign of motions, as if they had been read from tables."""

    def made(motions):
        monkeypatch.setattr(sensor_consistency, "measured", lambda table, profile: table)
        monkeypatch.setattr(contradictions, "find", lambda table, profile: Contradictions((), ()))
        return campaign(motions, sailing.profile())

    return made


def clock(estimates) -> Estimate | None:
    wanted = "clock_offset", "yaw_rate"
    return next((e for e in estimates if (e.kind, e.channel) == wanted), None)


def test_several_short_voyages_know_a_clock_better_than_each(of):
    late = 0.15
    motions = {f"v{i}": motion(100 + i, 60.0, late) for i in range(6)}
    found = clock(of(motions).estimates)
    alone = [
        clock(sensor_consistency.of_motion(m, sailing.profile()).estimates)
        for m in motions.values()
    ]
    assert found.low < late < found.high
    widths = [np.inf if e is None else e.high - e.low for e in alone]
    assert found.high - found.low < 0.6 * np.median(widths)
    assert found.notable and not all(e is not None and e.notable for e in alone)


def test_a_voyage_that_deviates_is_named_and_no_other(of):
    motions = {f"v{i}": motion(i, 120.0, 0.8 if i == 3 else 0.0) for i in range(6)}
    found = of(motions)
    key = "clock_offset", "yaw_rate"
    assert [one.voyage for one in found.deviating[key]] == ["v3"]
    assert found.deviating[key][0].estimate.value == pytest.approx(0.8, abs=0.1)


def test_voyages_do_not_run_into_each_other():
    one, other = motion(0, 30.0), motion(1, 20.0)
    both = join([one, other])
    assert np.flatnonzero(both.starts).tolist() == [0, 300]
    assert len(both.heading) == 500 and both.position.shape == (500, 2)


def test_a_long_voyage_leaves_room_for_the_others(monkeypatch):
    monkeypatch.setattr(campaign_consistency, "CAMPAIGN_ROWS", 400)
    both = join([motion(0, 100.0), motion(1, 10.0)])
    assert np.flatnonzero(both.starts).tolist() == [0, 200] and len(both.starts) == 300


@pytest.mark.parametrize(
    ("days", "expected"),
    [
        ({"a": 0, "b": 10, "c": 95}, [["a", "b", "c"]]),
        ({"c": 200, "a": 0, "b": 10}, [["a", "b"], ["c"]]),
        ({}, []),
    ],
)
def test_seasons_are_apart_where_nothing_was_sailed_for_three_months(days, expected):
    assert seasons({name: day * DAY for name, day in days.items()}) == expected


def test_what_is_apart_by_less_than_matters_or_than_is_known_does_not_deviate():
    one = Estimate("clock_offset", "yaw_rate", 0.5, 0.45, 0.55, 0.0, 0.05, "s")
    assert deviates(one, replace(one, value=0.2, low=0.15, high=0.25))
    assert not deviates(one, replace(one, value=0.46, low=0.4599, high=0.4601))
    assert not deviates(one, replace(one, value=0.2, low=-0.3, high=0.7))


def test_parts_of_a_stored_voyage_are_a_campaign(tmp_path):
    store = Store(tmp_path / "store")
    store.add(
        ingest(sailing.write(tmp_path / "trip.mcap", sailing.series(130.0)), sailing.profile())
    )
    ((whole, _),) = sensors.campaigns(store, ())
    ((halves, _),) = sensors.campaigns(store, ["trip[65:130]", "trip[0:65]"])
    assert whole.voyages == ("trip",)
    assert halves.voyages == ("trip[0:65]", "trip[65:130]")
