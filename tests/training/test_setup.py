"""What an identification begins with, in a sentence; how finely it steps; how it ends."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from shiplog.exceptions import RunError
from shiplog.models.coefficients import ParameterEntry, parameters
from shiplog.training.physics import setup
from shiplog.training.physics.cross_validation import finite_mean
from shiplog.training.physics.held_out import _sentence
from shiplog.training.physics.setup import Prepared


def test_the_sentence_counts_what_may_move():
    start = SimpleNamespace(names=("drag", "thrust", "lift"), source="a file")
    free = np.array([True, False, True])
    ready = Prepared(None, start, None, ["a", "a", "b", "b"], [], free, None)  # type: ignore[arg-type]
    rest = "of 3 parameters free, 4 windows, starting values from a file"
    assert ready.sentence(fit=True) == f"2 {rest}"
    assert ready.sentence(fit=False) == f"0 {rest}"


def test_a_parameter_that_cannot_move_is_not_identified_alone():
    """A thruster that only pushes ahead: its spread is its thrust, which is 0 astern."""
    thrust, loss = (ParameterEntry("T", "", share, least, 0.0, 1e7, unit="N")
                    for share, least in ((1.0, 0.0), (0.0, 0.5)))  # fmt: skip
    wanted = {
        "thruster.bow_ahead": thrust,
        "thruster.bow_astern": thrust,
        "thruster.bow_loss": loss,
    }
    given = {"thruster": {"bow_ahead": 40.0, "bow_astern": 0.0, "bow_loss": 0.0}}
    start = parameters(wanted, given, "a file")
    for patterns, free in (((), [True] * 3), (("*ahead",), [True, False, False]),
                           (("*_loss", "*astern"), [False, True, True])):  # fmt: skip
        assert setup.free_parameters(patterns, start).tolist() == free
    with pytest.raises(RunError, match=r"the plausible spread of thruster\.bow_astern is a share"):
        setup.free_parameters(("*astern",), start)


def test_a_loss_that_is_huge_but_finite_is_no_stable_start(monkeypatch):
    @dataclass(frozen=True)
    class Stiff:
        substeps: int = 1

    by_substeps = {1: 1e200, 2: np.nan, 4: 3.0, 8: 3.0}
    monkeypatch.setattr(
        setup, "losses", lambda model, values, data: np.array([1.0, by_substeps[model.substeps]])
    )
    assert setup._stable(Stiff(), None, None).substeps == 4  # type: ignore[arg-type]  # stand-ins


def test_means_are_of_the_windows_that_end_and_the_others_are_counted():
    before, after = np.array([4.0, 6.0, np.inf]), np.array([1.0, 3.0, 2.0])
    assert _sentence("training windows", before[:2], after[:2]) == (
        "Mean L over 2 training windows: 5 at the start, 2 identified (0.400)."
    )
    assert _sentence("training windows", before, after) == (
        "Mean L over 2 training windows: 5 at the start, 2 identified (0.400). "
        "Of 3, 1 diverge at the start."
    )
    none = np.full(2, np.inf)
    assert _sentence("windows", after[:2], none) == "Of 2 windows, 2 diverge identified."
    assert finite_mean(before) == "5 (1 more diverge)" and finite_mean(after) == "2"
    assert finite_mean(none) == "without an end in any window"
