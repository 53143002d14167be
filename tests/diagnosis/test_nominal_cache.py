"""The key of a kept fit changes with all that the fit depends on."""

from dataclasses import replace

import numpy as np
import pytest
from toy_ship import RECORD, SETTING, THETA, Toy

from shiplog.diagnosis.nominal import nominal_cache
from shiplog.machine import disk_cache
from shiplog.models.causes.sensors import HeadingOffset
from shiplog.models.starting_values import Start
from shiplog.voyages.rows.timescale import Timescale

START = Start(THETA, 0.1 * THETA, np.full(4, -1.0), np.ones(4))


def key(model=None, setting=SETTING, start=START, record=RECORD) -> str:
    return nominal_cache._key(model or Toy(), setting, start, record)


@pytest.mark.parametrize(
    "changed",
    [
        lambda: key(Toy((HeadingOffset(),))),
        lambda: key(setting=replace(SETTING, scale=SETTING.scale | {"speed": 0.7})),
        lambda: key(start=replace(START, spread=0.2 * THETA)),
        lambda: key(record=replace(RECORD, timescale=Timescale(60.0, 4.0, 4.0))),
        lambda: key(record=replace(RECORD, wind=RECORD.wind + 1e-9)),
        lambda: key(record=replace(RECORD, measured=~RECORD.measured)),
    ],
    ids=["causes", "scale", "spread", "time scale", "wind", "measured"],
)
def test_another_input_has_another_key(changed):
    assert key() == key() != changed()


def test_another_program_or_library_has_another_key(monkeypatch):
    before = key()
    with monkeypatch.context() as patch:
        patch.setattr(np, "__version__", "0.0.1")
        assert key() != before
    monkeypatch.setattr(disk_cache, "source", lambda: b"another")
    assert key() != before
