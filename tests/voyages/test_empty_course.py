"""A speed without a course, near rest and under way."""

import math

import numpy as np
import pytest

from shiplog.voyages.samples import empty_course

NAN = math.nan


@pytest.mark.parametrize(
    ("speed", "course", "velocity"),
    [(0.06, NAN, (0.0, 0.0)), (0.25, NAN, (0.0, 0.0)), (0.0, NAN, (0.0, 0.0)),
     (0.06, 1.0, (0.06, 1.0)), (3.0, 1.0, (3.0, 1.0)), (3.0, NAN, (3.0, NAN)),
     (NAN, NAN, (NAN, NAN)), (-0.1, NAN, (-0.1, NAN))],
)  # fmt: skip
def test_near_rest_the_velocity_is_known(speed, course, velocity):
    np.testing.assert_equal(empty_course.fill(np.array([[speed, course]])), [velocity])


def test_how_many_have_no_course_is_said_once():
    value = np.array([[0.06, NAN], [0.2, NAN], [2.0, 1.0]])
    (said,) = empty_course.findings(value, "/gnss/velocity")
    assert (said.kind, said.channel, said.value) == ("not_available", "velocity", 0.2)
    assert "2 of 3" in said.sentence
    assert empty_course.findings(value[2:], "/gnss/velocity") == []
