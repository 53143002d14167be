"""What reports say of a motion that was derived, and what that adds to L."""

import math

import numpy as np
import pytest
from sailing import PROFILE, profile

from shiplog.logs.health.health_report import DerivedChannel, VoyageReport
from shiplog.models import causes
from shiplog.models.causes import Setting
from shiplog.report.evaluation import derived, tables
from shiplog.simulation import scoring

SURGE = DerivedChannel("surge", "position", 0.004, 0.003, "m/s", 0.01, 0.02)
YAW = DerivedChannel("yaw_rate", "heading", 0.08, 0.05, "deg/s", 0.1, 0.3)


def without_rates(text=PROFILE):
    cut = text[: text.index("[sensors.velocity]")] + text[text.index("[sensors.heading]") :]
    return cut[: cut.index("[sensors.yaw_rate]")] + cut[cut.index("[sensors.wind]") :]


def test_a_perfect_model_has_the_loss_that_the_deviations_expect():
    """By drawing errors of these sizes and scoring them."""
    sigma = np.array([0.003, 0.0, math.radians(0.05)])
    error = np.zeros((4000, 50, 6))
    error[..., [1, 3, 5]] = np.random.default_rng(0).normal(size=(4000, 50, 3)) * sigma
    drawn = scoring.window_loss(error, np.ones((4000, 49))).mean()
    assert scoring.loss_of_deviations(sigma, 49.0) == pytest.approx(drawn, rel=0.01)
    assert derived.expected_loss((SURGE, YAW), 49.0) == pytest.approx(drawn, rel=0.01)


def test_several_voyages_have_the_root_mean_square():
    found = derived.together([
        VoyageReport("one", 0, 0, 0, 0.0, derived=(SURGE,)),
        VoyageReport("two", 0, 0, 0, 0.0, derived=(
            DerivedChannel("surge", "position", 0.003, 0.004, "m/s", 0.01, 0.02),)),
        VoyageReport("measured", 0, 0, 0, 0.0),
    ])  # fmt: skip
    assert [one.channel for one in found] == ["surge"]
    assert found[0].sigma == found[0].sigma_mean == pytest.approx(math.sqrt(12.5e-6))


def test_reports_say_what_was_measured_and_what_was_derived():
    pose = profile(without_rates())
    assert derived.of_profile(profile()) == ""
    said = derived.of_profile(pose)
    assert said.startswith("Measured: position and heading. Derived")
    assert "surge, sway and yaw rate" in said
    lines = tables.voyage_lines(
        VoyageReport("one", 9, 0, 9, 9.0, usable_s=9, windows=0, derived=(SURGE, YAW))
    )
    assert "surge ± 0.004 m/s, yaw rate ± 0.08 deg/s" in lines[1]
    assert "a position scatters by 0.01 m, a heading scatters by 0.1 deg" in lines[1]
    assert "A perfect model would have L" in derived.loss_sentence((SURGE, YAW), 99.0)
    assert derived.loss_sentence((), 99.0) == ""


def test_causes_that_need_a_velocity_are_not_testable_and_say_so():
    scale = {"speed": 0.8, "length": 3.0, "mass": 240.0, "moment": 720.0}
    places = np.zeros((1, 2))
    _, all_of_it = causes.testable(Setting(profile(), scale, places, 1.0))
    tested, left = causes.testable(Setting(profile(without_rates()), scale, places, 1.0))
    new = {label: why for label, why in left.items() if label not in all_of_it}
    assert set(new) == {
        "clock_offset:velocity", "clock_offset:gnss", "clock_offset:yaw_rate", "yaw_rate_bias",
        "yaw_rate_scale",
    }  # fmt: skip
    assert "derived from the position" in new["clock_offset:velocity"]
    assert new["yaw_rate_bias"] == "no yaw rate is recorded"
    labels = {one.label for one in tested}
    assert {"clock_offset:position", "antenna_offset", "heading_offset", "current"} <= labels
