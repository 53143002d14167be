"""The fuzzer's targets on its shipped beginnings: each is taken, and what is not is a sentence."""

import pytest

from pipelines.experiments.fuzzing.__main__ import BEGINNINGS, TARGETS, refused
from shiplog.exceptions import LogUnreadable, ShiplogError
from shiplog.logs.reading.read import read

FILES = sorted(path for path in BEGINNINGS.rglob("*.*"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}-{path.name}")
def test_every_beginning_goes_through_its_target(path):
    TARGETS[path.parent.name](path.read_bytes())


@pytest.mark.parametrize("target", TARGETS)
def test_every_target_has_beginnings_and_refuses_rubbish_with_a_sentence(target):
    assert any(path.parent.name == target for path in FILES)
    TARGETS[target](b"\xff\x00 rubbish")


@pytest.mark.parametrize(("name", "count"), [("chunks", 24), ("stored", 24), ("alone", 4)])
def test_the_beginnings_of_logs_are_whole(name, count):
    assert read(BEGINNINGS / "logs" / f"{name}.mcap").health.messages_read == count


def test_what_is_no_sentence_goes_on(tmp_path):
    def raising(error):
        def reader(_path):
            raise error

        return reader

    assert refused(raising(LogUnreadable("it holds no messages", hint="record again")), tmp_path)
    assert not refused(lambda path: path, tmp_path)
    for error in (ZeroDivisionError(), ShiplogError("no")):
        with pytest.raises((ZeroDivisionError, AssertionError)):
            refused(raising(error), tmp_path)
