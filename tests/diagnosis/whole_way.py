"""Campaigns of the simulated ship through logs and store, and what is decided of them."""

import math
from dataclasses import replace

import pytest

from pipelines.experiments.simulated_ship import Laws, cases, sensors
from shiplog.diagnosis.hypotheses import as_it_stands, search
from shiplog.diagnosis.nominal import placebo
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict.decide import decide
from shiplog.ship_profile import file as profiles

SEED = 7101
PROFILE = profiles.load("esso-vectwin")
NOMINAL = ("nominal_1", "nominal_3", "nominal_5", "nominal_6")  # 3400 s
TIDE = """
import jax.numpy as jnp
from shiplog.models.causes import Cause, Parameter


class Tide(Cause):
    name = "far_tether"
    kind = "environment"
    story = "A long line pulls it."
    equation = "X₀ = {north:.2f} N, Y₀ = {east:.2f} N along the earth's axes"
    parameters = (Parameter("north", "N", 1.0, 0.1), Parameter("east", "N", 1.0, 0.1))

    def force(self, p, state, at):
        c, s = jnp.cos(state[..., 4]), jnp.sin(state[..., 4])
        return jnp.stack((c * p[0] + s * p[1], c * p[1] - s * p[0], 0.0 * c), -1)
"""


def hidden(cause: str, size: float = 1.0, **changes) -> cases.Case:
    """This ship with something hidden for 500 s, two voyages; `changes` to what is hidden.

    Under the sample logs' laws: thresholds here are of the program, with a ship that it can fit.
    """
    case = cases.draw(SEED, cause=cause, size=size, seconds=500)
    return replace(case, laws=Laws(), effects=replace(case.effects, **changes))


def log(case: cases.Case, leg: cases.Leg, folder):
    path = folder / f"{leg.name}.mcap"
    sensors.write_voyage(path, cases.voyage(case, leg), seed=leg.seed, start=leg.start)
    return path


def judged(campaign, observed, sets=2):
    """A trial of a record, and the decision before anything was held out.

    sets  of causes that are searched: here one cause acts at most, found when each is tried alone
    """
    trial, point = as_it_stands.begin(Trial.build(campaign, observed), {})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search, "MOST_SETS", sets)
        found = search.Search(trial, point, placebo.placebos(campaign))
        found.run()
    return trial, decide(found)[0]


def labels(decision) -> list[str]:
    return [n.cause.label for n in decision.named]


def truth(case) -> dict:
    return {k: v["value"] for k, v in case.causes[0].parameters.items()}


def apart(a: float, b: float) -> float:
    """Between two directions [deg]."""
    return abs((a - b + 180.0) % 360.0 - 180.0)


def turned(observed):
    """The pond turned by 90 deg: what was north is east."""
    state = observed.state.copy()
    state[:, 0], state[:, 2] = -observed.state[:, 2], observed.state[:, 0]
    state[:, 4] += 0.5 * math.pi
    return replace(observed, state=state)
