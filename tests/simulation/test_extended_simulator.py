"""Runs that were extended by causes."""

from dataclasses import dataclass
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import polars as pl
import pytest

from shiplog.models import mmg
from shiplog.models.causes.steering import RudderDelay, RudderLag
from shiplog.models.extended import Extended
from shiplog.nomenclature import frames
from shiplog.ship_profile import file as profiles
from shiplog.simulation.extended_simulator import ExtendedSimulator, Extension
from shiplog.voyages.windows.windows import Windows

FERRY = profiles.load("milliampere")  # steered by azimuths


@jax.tree_util.register_static
@dataclass(frozen=True)
class Repeating:
    """u̇ is the angle of the first azimuth, whichever turn it is in."""

    substeps: int = 1
    smooth: float = 0.0
    names: ClassVar = ()

    def acceleration(self, theta, state, actuator, true_wind):
        nothing = jnp.zeros_like(actuator[..., 0])
        return jnp.stack((actuator[..., 0], nothing, nothing), -1)


def acted(causes, numbers, recorded: np.ndarray) -> np.ndarray:
    """The angles that a model with these causes is driven by, second by second."""
    count = len(recorded)
    actuator = np.zeros((1, count, len(FERRY.actuators)))
    actuator[0, :, 0] = recorded
    plan = pl.DataFrame({"voyage": ["a"], "elapsed": [0.0]})
    cut = Windows(plan, np.zeros((1, count, 6)), actuator, np.zeros((1, count, 0)),
                  np.ones((1, count - 1)))  # fmt: skip
    ship, main, _ = mmg.geometry_of(FERRY)
    model = Extended(Repeating(), causes, mmg.MMG(ship), mmg.estimated(ship, main).values, {})
    theta = np.array(numbers)
    simulator = ExtendedSimulator(model, theta, np.zeros((len(theta),) * 2), FERRY)
    return np.diff(simulator.simulate(cut)[0, :, 1])


def test_an_azimuth_that_passes_180_degrees_does_not_swing_round_the_other_way():
    """It turns by 0.02 rad/s. A delay of 1.5 s is 0.03 rad; a lag of T behind a ramp is
    0.02 T (1 - exp(-t/T)), from balance at the begin."""
    time = np.arange(60.0)
    turned = np.pi - 0.3 + 0.02 * time
    recorded = frames.wrap(turned)
    assert acted((), (), recorded) == pytest.approx(recorded[:-1], abs=1e-12)
    late = acted((RudderDelay(what="azimuths"),), (1.5,), recorded)
    assert late[2:] == pytest.approx(frames.wrap(turned - 0.03)[2:-1], abs=1e-9)
    behind = 0.02 * 2.0 * (1.0 - np.exp(-time / 2.0))
    slow = acted((RudderLag(what="azimuths"),), (2.0,), recorded)
    assert slow == pytest.approx(frames.wrap(turned - behind)[:-1], abs=1e-9)


@pytest.mark.parametrize("count", [1, 3, 4])
def test_each_cause_of_an_extension_has_its_numbers_and_their_covariance(count):
    """The catalogue's bank has three numbers; what has more or fewer is no extension."""
    arrays = {"coefficients": np.zeros(3), "covariance": np.diag(np.arange(1.0, count + 2.0))}
    causes = [{"label": "bank", "name": "bank", "made": {}, "numbers": [0.7] * count},
              {"label": "yaw_rate_bias", "name": "yaw_rate_bias", "made": {},
               "numbers": [0.001]}]  # fmt: skip
    facts = {"causes": causes, "shares": {}, "lengths": {}}
    if count != 3:
        with pytest.raises(ValueError, match=f"bank has {count} numbers, not 3"):
            Extension.from_record(facts, arrays)
        return
    kept = Extension.from_record(facts, arrays)
    assert kept.numbers["bank"].tolist() == [0.7] * 3
    assert kept.covariance["bank"].tolist() == np.diag([1.0, 2.0, 3.0]).tolist()
    assert kept.numbers["yaw_rate_bias"].tolist() == [0.001]
    assert kept.covariance["yaw_rate_bias"].tolist() == [[4.0]]
