"""The course of a force that is on or off, against all courses that there are."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad

from shiplog.diagnosis.noise import on_off

NODES = 16


def rows_of(segments: int) -> np.ndarray:
    """[S, J] of segments that meet: the last node of one is the first of the next."""
    return 150 * np.arange(segments)[:, None] + 10 * np.arange(NODES)


def test_the_most_probable_course_of_all():
    rng = np.random.default_rng(2)
    for _ in range(20):
        each = 2.0 * rng.standard_normal((9, 2))
        transitions = np.log([[0.9, 0.1], [0.3, 0.7]])

        def value(states, each=each, transitions=transitions):
            steps = sum(transitions[a, b] for a, b in itertools.pairwise(states))
            return steps + sum(each[i, s] for i, s in enumerate(states))

        best = max(itertools.product((0, 1), repeat=9), key=value)
        assert on_off._most_probable(each, transitions).tolist() == [bool(s) for s in best]


def test_pulses_are_found_where_they_are():
    """Of 3 N, to either side, next to noise of 0.2 N; one node of 1 N is no pulse."""
    rng, rows = np.random.default_rng(0), rows_of(20)
    on = np.zeros(rows.shape, dtype=bool)
    for segment in range(0, 20, 2):
        on[segment, 4:10] = True
    force = 3.0 * on * rng.choice([-1.0, 1.0], (20, 1)) + 0.2 * rng.standard_normal(on.shape)
    force[5, 7] = 1.0
    found = on_off.course(force, np.full(on.shape, 0.2), rows)
    assert found is not None
    assert found.on == tuple((150 * s + 40, 150 * s + 90) for s in range(0, 20, 2))
    # what is on across the node that two segments share is one run
    on[0, 10:] = on[1, :3] = True
    across = on_off.course(3.0 * on, np.full(on.shape, 0.2), rows)
    assert across is not None and across.on[0] == (40, 170)


def test_a_force_that_is_always_on_has_no_course():
    rows = rows_of(4)
    assert on_off.course(np.full(rows.shape, 3.0), np.full(rows.shape, 0.2), rows) is None


def test_the_prior_of_a_course_is_that_of_any_probability_of_a_change():
    """Of off, on, on, off, off: a change to on after one of two, a change to off after one of
    two; either state may be the first. Integrated over both probabilities."""
    course = np.array([False, True, True, False, False])
    of_each = quad(lambda p: p * (1.0 - p), 0.0, 1.0)[0]
    assert on_off._log_prior(course) == pytest.approx(math.log(0.5 * of_each**2))


def test_nodes_of_one_run_belong_together():
    """On from row 30 to row 60, and from 80 on; of a segment that begins at row 20."""
    rows = 20 + 10 * np.arange(8)[None]
    found = on_off.runs(((30, 60), (80, 200)), rows)[0]
    first, second = [1, 2, 3, 4], [6, 7]
    wanted = np.zeros((8, 8))
    for run in (first, second):
        wanted[np.ix_(run, run)] = 1.0
    assert (found == wanted).all()
