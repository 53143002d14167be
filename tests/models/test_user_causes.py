"""Causes from a user's own file: accepted, or refused with what to mend."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from own_causes import GOOD

from shiplog.exceptions import RunError
from shiplog.models.causes import user


def write(folder, text, name="mine.py"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_a_good_file(tmp_path):
    (cause,) = user.load([write(tmp_path, GOOD)])
    assert (cause.name, cause.user, cause.count) == ("tide_gate", True, 1)
    assert not cause.reads
    state = np.array([[0.0, 0.5, 0.0, 0.0, 0.5 * np.pi, 0.0]])
    pull = cause.force((jnp.asarray(3.0),), state, {})
    assert np.asarray(pull) == pytest.approx(np.array([[0.0, -3.0, 0.0]]))
    assert hash(cause) == hash(dataclasses.replace(cause))  # a model with it is compiled once


def test_several_files_and_several_causes_keep_their_order(tmp_path):
    more = GOOD.replace("tide_gate", "second").replace("class Tide", "class Second")
    both = write(tmp_path, GOOD + more.split("Parameter\n", 1)[1])
    third = write(tmp_path, GOOD.replace("tide_gate", "third"), "other.py")
    assert [c.name for c in user.load([both, third])] == ["tide_gate", "second", "third"]


def test_none_is_none():
    assert user.load([]) == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("def broken(:\n", "SyntaxError"),
        ("import nothing_of_that_name\n", "nothing_of_that_name"),
        ("x = 1\n", "defines no cause"),
        ("from shiplog.models.causes.environment import Current\n", "defines no cause"),
        (GOOD.replace('"tide_gate"', '"current"'), "'current' already"),
        # of the catalogue's clocks each has this name, and a channel in its label
        (GOOD.replace('"tide_gate"', '"clock_offset"'), "'clock_offset' already"),
        (GOOD.replace("X = {north", "X = {u} {north"), "equation"),
        (GOOD.replace('"tide_gate"', '"unknown"'), "'unknown' already"),
        (
            GOOD.replace("    def force", "    def __init__(self, d): ...\n\n    def force"),
            "argument",
        ),
        (GOOD.replace('    kind = "environment"\n', ""), "Tide has no kind"),
        (GOOD.replace("    story =", "    tale ="), "Tide has no story"),
    ],
    ids=(
        "syntax",
        "import",
        "none",
        "imported",
        "taken",
        "clock",
        "braces",
        "answer",
        "field",
        "kind",
        "story",
    ),
)
def test_a_file_that_cannot_be_taken_says_why(tmp_path, text, words):
    path = write(tmp_path, text)
    with pytest.raises(RunError, match=words) as found:
        user.load([path])
    assert found.value.hint


def test_two_files_cannot_share_a_name(tmp_path):
    files = [write(tmp_path, GOOD, "one.py"), write(tmp_path, GOOD, "two.py")]
    with pytest.raises(RunError, match="'tide_gate' already"):
        user.load(files)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(RunError, match="no Python file"):
        user.load([tmp_path / "missing.py"])
