"""Conventions turned round, on a model whose loss of each is known."""

from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest

from shiplog.diagnosis import sign_conventions
from shiplog.simulation.error_reduction import RUNAWAY
from shiplog.voyages.windows import Windows

ORDERS = np.array([0.2, -0.1, 8.0])  # two rudders and a propeller
KINDS = ("rudder", "rudder", "propeller")
PROFILE = SimpleNamespace(actuators=[SimpleNamespace(kind=kind) for kind in KINDS])


def windows(count: int = 4) -> Windows:
    actuator = np.broadcast_to(ORDERS, (count, 5, 3)).copy()
    wind = np.tile([3.0, 0.5], (count, 5, 1))
    return Windows(
        pl.DataFrame(), np.zeros((count, 5, 6)), actuator, wind, np.ones((count, 4))
    )  # fmt: skip


def simulator(true: np.ndarray, otherwise: float) -> SimpleNamespace:
    """L is 5 with these orders; with others, `otherwise` in the first window and 90 in the rest."""

    def losses(cut):
        if np.array_equal(cut.actuator[0, 0], true) and cut.wind[0, 0, 1] == 0.5:
            return np.full(len(cut), 5.0)
        return np.append(otherwise, np.full(len(cut) - 1, 90.0))

    return SimpleNamespace(profile=PROFILE, losses=losses)


@pytest.mark.parametrize("otherwise", [90.0, np.inf, np.nan], ids=str)
@pytest.mark.parametrize(
    ("true", "words"),
    [((-0.2, 0.1, 8.0), "the rudder's sign"), ((-0.1, 0.2, 8.0), "the two rudders exchanged"),
     ((0.2, -0.1, -8.0), "the propeller's sign")],
)  # fmt: skip
def test_the_convention_that_the_log_has_is_found_whatever_the_others_do(true, words, otherwise):
    found, loss = sign_conventions.best(simulator(np.array(true), otherwise), windows())
    assert found.startswith(words)
    assert loss == 5.0


def test_where_all_diverge_the_loss_is_that_of_a_divergence():
    """One of four windows: a quarter of RUNAWAY, and three quarters of 90."""
    _, loss = sign_conventions.best(simulator(np.ones(3), np.nan), windows())
    assert loss == pytest.approx(0.25 * RUNAWAY + 67.5)
