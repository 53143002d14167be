"""Voyages as the diagnosis reads them: stretches, what was measured, later values, sights."""

import math
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import closed
import numpy as np
import polars as pl
import pytest

from shiplog.nomenclature import frames
from shiplog.nomenclature.channels import Quality
from shiplog.ship_profile import file as profiles
from shiplog.voyages.rows import one_hertz, recording
from shiplog.voyages.windows import windows

PROFILE = profiles.load("esso-vectwin")
BODY = profiles.load("esso-osaka")
DAY = datetime(2026, 5, 1, 10, tzinfo=UTC)


def table(count: int, start: datetime = DAY, **columns) -> pl.DataFrame:
    """A 10 Hz table of a ship that goes north at 1 m/s; `columns` replace its own."""
    t = 0.1 * np.arange(count)
    zero = np.zeros(count)
    values = {
        "x0": t, "surge": zero + 1.0, "y0": zero, "sway": zero, "heading": zero,
        "yaw_rate": zero, "rudder_port": 0.01 * t, "rudder_starboard": zero, "propeller": zero + 5,
        "wind_speed": zero + 2.0, "wind_angle": zero + 0.5 * math.pi,
    }  # fmt: skip
    quality = columns.pop("quality", np.zeros(count, dtype=np.int64))
    step = timedelta(milliseconds=100)
    stamps = pl.datetime_range(
        start, start + (count - 1) * step, step, time_unit="ns", eager=True
    ).alias("time")
    return pl.DataFrame([stamps]).with_columns(
        *(pl.Series(n, v) for n, v in (values | columns).items()), pl.Series("quality", quality)
    )


def faulty(count: int, *gaps: tuple[int, int], mark: Quality = Quality.GAP) -> np.ndarray:
    quality = np.zeros(count, dtype=np.int64)
    for a, b in gaps:
        quality[a:b] = int(mark)
    return quality


def read(*tables: pl.DataFrame, profile=PROFILE):
    return recording.read(tables, [f"v{i}" for i in range(len(tables))], profile)


# --- gaps -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("mark", (Quality.GAP, Quality.SPIKE, Quality.FROZEN, Quality.LIMITS))
def test_a_gap_shorter_than_two_seconds_is_bridged_and_unseen(mark):
    hole = np.arange(100) * 0.1
    hole[40:59] = 77.0  # what stands in marked rows is nobody's business
    found = read(table(100, x0=hole, quality=faulty(100, (40, 59), mark=mark)))
    assert len(found) == 100
    assert found.starts.tolist() == [True] + [False] * 99
    assert np.flatnonzero(~found.measured).tolist() == list(range(40, 59))
    assert found.state[:, 0] == pytest.approx(0.1 * np.arange(100), abs=1e-9)
    assert found.seconds == pytest.approx(8.1)


def test_a_gap_of_two_seconds_starts_a_stretch():
    for rows, kept in ((20, True), (21, False)):
        found = read(table(100, quality=faulty(100, (40, 40 + rows))))
        assert len(found) == (100 if kept else 100 - rows)
        assert found.starts.sum() == (1 if kept else 2)
    assert np.flatnonzero(found.starts).tolist() == [0, 40]
    assert found.measured.all()
    assert found.time[[39, 40]] == pytest.approx([3.9, 6.1])
    assert (found.firsts[[0, 39, 40, 78]] == [0, 0, 40, 40]).all()
    assert (found.lasts[[0, 39, 40, 78]] == [39, 39, 78, 78]).all()


def test_gaps_at_the_ends_are_left_away():
    found = read(table(100, quality=faulty(100, (0, 5), (95, 100))))
    assert len(found) == 90
    assert found.time[0] == pytest.approx(0.5)
    assert found.measured.all()


def test_a_value_that_is_missing_is_a_gap():
    hole = 0.1 * np.arange(100)
    hole[50] = np.nan
    found = read(table(100, y0=hole))
    assert np.flatnonzero(~found.measured).tolist() == [50]
    assert found.state[50, 2] == pytest.approx(5.0)


def test_a_jump_starts_a_stretch_and_is_found():
    found = read(table(100, quality=faulty(100, (30, 31), mark=Quality.JUMP)))
    assert np.flatnonzero(found.starts).tolist() == [0, 30]
    assert found.measured.all()


def test_headings_run_on_and_gaps_are_bridged_the_short_way():
    """From 179 deg to -179 deg are two degrees, recorded or bridged."""
    turning = 3.0 + 0.01 * np.arange(100)
    wrapped = (turning + np.pi) % (2 * np.pi) - np.pi
    found = read(table(100, heading=wrapped, quality=faulty(100, (10, 20))))
    assert found.state[:, 4] == pytest.approx(turning, abs=1e-9)


def test_wind_comes_as_components():
    found = read(table(50))
    assert found.wind == pytest.approx(np.tile([0.0, 2.0], (50, 1)), abs=1e-12)
    # at 1 m/s ahead, heading north: the true wind comes from 1 m/s astern of what it feels
    assert found.true_wind == pytest.approx(np.tile([-1.0, 2.0], (50, 1)), abs=1e-12)
    quiet = table(50).drop("wind_speed", "wind_angle")
    calm = PROFILE.model_copy(update={"sensors": PROFILE.sensors.model_copy(update={"wind": None})})
    assert (read(quiet, profile=calm).wind == 0.0).all()


def test_true_wind_turns_with_the_ship():
    """What closed form says of a turning ship in a steady wind."""
    observed = closed.record(PROFILE)
    assert observed.true_wind == pytest.approx(
        np.tile(closed.TRUE_WIND, (len(observed), 1)), abs=1e-12
    )


# --- campaigns ------------------------------------------------------------------------------------


def test_voyages_stand_in_order_of_time_with_their_share():
    late = table(60, DAY + timedelta(days=3), y0=np.full(60, 3.0))
    early = table(40, DAY, y0=np.full(40, 1.0))
    found = recording.read([late, early], ["late", "early"], PROFILE)
    assert found.names == ("early", "late")
    assert (found.state[:40, 2] == 1.0).all() and (found.state[40:, 2] == 3.0).all()
    assert found.voyage.tolist() == [0] * 40 + [1] * 60
    assert found.share == pytest.approx((np.arange(100) + 0.5) / 100)
    assert found.time[40] == 0.0
    assert np.flatnonzero(found.starts).tolist() == [0, 40]
    picked = found.pick(["late"])
    assert len(picked) == 60 and picked.names == found.names
    assert picked.share[0] == pytest.approx(0.405)
    assert (picked.state[:, 2] == 3.0).all()


# --- later values ---------------------------------------------------------------------------------


def ramps():
    """Two stretches, a ramp of 2 a second in the first, -1 a second in the second."""
    found = read(table(60), table(40, DAY + timedelta(days=1)))
    t = 0.1 * np.arange(60), 0.1 * np.arange(40)
    return found, np.concatenate((2.0 * t[0], 50.0 - t[1])), t


@pytest.mark.parametrize("seconds", (0.3, 1.234, -0.07, -2.5, 99.0, -99.0))
def test_later_values_of_a_ramp(seconds):
    """On the ramp exactly, and standing where a stretch ends."""
    found, values, (one, two) = ramps()
    first = 2.0 * np.clip(one + seconds, 0.0, 5.9)
    second = 50.0 - np.clip(two + seconds, 0.0, 3.9)
    answer = np.concatenate((first, second))
    assert found.later(values, seconds) == pytest.approx(answer, abs=1e-9)
    pair = np.stack((values, 3.0 * values), -1)
    assert found.later(pair, seconds) == pytest.approx(np.stack((answer, 3.0 * answer), -1))


def test_no_time_later_is_the_same():
    found, values, _ = ramps()
    assert found.later(values, 0.0) is values


def test_a_smoothed_ramp_stays_and_a_wave_is_less_by_its_mean():
    """A ramp to the very ends of its stretch; of a wave of f hertz a mean over T leaves
    sin(πfT)/πfT (of n samples sin(πfnh)/(n sin πfh)), and two of them its square."""
    found, ramp, _ = ramps()
    given = replace(found, state=np.repeat(ramp[:, None], 6, 1))
    assert given.smoothed(2.0).state == pytest.approx(given.state, abs=1e-9)
    t = 0.1 * np.arange(len(found))
    wave = replace(found, state=np.repeat(np.cos(2.0 * np.pi * 0.3 * t)[:, None], 6, 1))
    left = wave.smoothed(2.0).state[:, 0]
    wanted = (np.sin(np.pi * 0.3 * 2.1) / (21.0 * np.sin(np.pi * 0.3 * 0.1))) ** 2
    inside = slice(21, 39)  # two half widths from either end of the first stretch
    assert left[inside] == pytest.approx(wanted * wave.state[inside, 0], abs=1e-9)
    assert wanted < 0.25


# --- sights ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", (PROFILE, BODY), ids=("over ground", "body axes"))
def test_sights_are_reduced_as_ingest_does(profile):
    """`reduced` undoes `sighted`, and both are the formulas of `midship`."""
    observed = closed.record(profile)
    sight = observed.sighted
    again = observed.measured_as(sight)
    assert again.state == pytest.approx(observed.state, abs=1e-12)
    arm = profile.sensors.position.lever_arm_m
    at = frames.position_at_midship(sight.position, observed.state[:, 4], arm)
    assert at == pytest.approx(observed.state[:, [0, 2]], abs=1e-12)
    velocity = sight.velocity
    if profile is PROFILE:
        velocity = frames.to_body(velocity, observed.state[:, 4])
    going = frames.velocity_at_midship(
        velocity, observed.state[:, 5], profile.sensors.velocity.lever_arm_m
    )
    assert going == pytest.approx(observed.state[:, [1, 3]], abs=1e-12)


def test_a_record_of_other_sights_has_the_axes_of_its_own_heading():
    """Axes are handed on with the sights: of a heading that was turned they are turned, too."""
    observed = closed.record(PROFILE)
    for sight, turned in ((observed.sighted, 0.0), (observed.sighted.turned(0.3), 0.3)):
        found = observed.measured_as(sight)
        assert found.state[:, 4] == pytest.approx(observed.state[:, 4] + turned)
        assert found.axes.cos == pytest.approx(np.cos(found.state[:, 4]), abs=1e-12)
        assert found.axes.sin == pytest.approx(np.sin(found.state[:, 4]), abs=1e-12)


def test_an_antenna_that_is_sighted_moves_as_its_velocity_says():
    """Over ground, the sighted velocity is the derivative of the sighted position."""
    observed = closed.record(PROFILE)
    sight = observed.sighted
    moved = (sight.position[2:] - sight.position[:-2]) / 0.2
    assert moved == pytest.approx(sight.velocity[1:-1], abs=2e-5)  # h²/6 of the third derivative
    still = replace(observed, state=observed.state * [1, 1, 1, 1, 1, 0]).sighted
    assert np.abs(moved - still.velocity[1:-1]).max() > 0.01  # the swing of the arm counts


def test_an_antenna_elsewhere_takes_its_velocity_along():
    observed = closed.record(PROFILE)
    sight = observed.sighted
    found = observed.measured_as(sight, (0.4, -0.1))
    c, s, r = np.cos(observed.state[:, 4]), np.sin(observed.state[:, 4]), observed.state[:, 5]
    back = found.state - observed.state
    assert back[:, 0] == pytest.approx(-(0.4 * c + 0.1 * s), abs=1e-12)
    assert back[:, 2] == pytest.approx(-(0.4 * s - 0.1 * c), abs=1e-12)
    assert back[:, 1] == pytest.approx(-0.1 * r, abs=1e-12)
    assert back[:, 3] == pytest.approx(-0.4 * r, abs=1e-12)


def test_windows_and_the_record_count_time_from_one_row():
    """A fix that comes after 100 s: x₀ says when each was measured."""
    made = table(3000, quality=faulty(3000, (0, 1000))).with_columns(voyage=pl.lit("v0"))
    seconds = one_hertz.resample([made.lazy()], PROFILE.columns, PROFILE.circular)
    plan = windows.plan(seconds.lazy(), 50, 50).collect()
    cut = windows.cut(seconds, plan, 50, PROFILE.actuator_names, PROFILE.wind_names)
    record = read(made)
    assert cut.plan["elapsed"][0] == 100.0
    by_record = np.interp(cut.state[:, 0, 0], record.state[:, 0], record.time)
    assert cut.plan["elapsed"].to_numpy() == pytest.approx(by_record, abs=1.0)
