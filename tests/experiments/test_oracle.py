"""What is hidden, in the catalogue's own numbers."""

import math

import numpy as np
import pytest

from pipelines.experiments.hidden_effects import oracle
from shiplog.models.causes import Setting
from shiplog.ship_profile import file as profiles


def test_the_truth_in_the_catalogues_own_numbers():
    """Reported as the contract has it, the numbers show just that again."""
    profile = profiles.load("esso-vectwin")
    scale = {"speed": 0.6, "length": 3.0, "mass": 244.6, "moment": 733.8}
    setting = Setting(profile, scale, np.zeros((12, 2)), 1.0)

    def numbers_of(name, **estimated):
        parameters = {k: {"value": v} for k, v in estimated.items()}
        return oracle.true_cause({"name": name, "parameters": parameters}, setting)

    for towards, want in (
        (190.0, [-0.0985, -0.0174]), (10.0, [0.0985, 0.0174]), (280.0, [0.0174, -0.0985]),
    ):  # fmt: skip
        cause, numbers = numbers_of("current", speed=0.1, direction=towards)
        assert cause.label == "current" and numbers == pytest.approx(want, abs=1e-4)
    _, numbers = numbers_of("payload", mass=30.0, position=-0.5)
    assert numbers == pytest.approx([30.0, -15.0], rel=1e-6)
    cause, numbers = numbers_of("clock_offset", time=0.4, channel="velocity")
    assert cause.label == "clock_offset:velocity" and numbers == pytest.approx([0.4])
    _, numbers = numbers_of("rudder_offset", port=-2.0, starboard=0.0)
    assert numbers == pytest.approx([-math.radians(2.0), 0.0], abs=1e-9)
    for name in ("bank", "side_thrust", "propeller_walk"):
        assert numbers_of(name) is None


def test_the_truth_of_one_unit_is_not_that_of_all():
    setting = Setting(profiles.load("blueboat"), {"speed": 1.0}, np.zeros((12, 2)), 1.0)
    factor = {"factor": {"value": 0.8}}
    for parameters, label in (
        (factor, "thrust_loss"),
        (factor | {"unit": {"value": "thruster_port"}}, "thrust_loss:thruster_port"),
    ):
        truth = {"name": "thrust_loss", "parameters": parameters}
        cause, numbers = oracle.true_cause(truth, setting)
        assert cause.label == label and numbers == pytest.approx([-0.2])
    nobody = {"name": "thrust_loss", "parameters": factor | {"unit": {"value": "bow"}}}
    assert oracle.true_cause(nobody, setting) is None
