"""When a message was measured, in every form in which a log says so."""

from __future__ import annotations

import numpy as np
import pytest
from made_logs import SECOND, START, json_log

from shiplog.logs.reading import salvage
from shiplog.logs.reading.read import read


@pytest.mark.parametrize(
    "stamp",
    [
        {"timestamp": {"sec": 1_700_000_000, "nsec": 5}},
        {"stamp": {"sec": 1_700_000_000, "nanosec": 5}},
        {"header": {"stamp": {"seconds": 1_700_000_000, "nanos": 5}}},
        {"timestamp": "2023-11-14T22:13:20.000000005Z"},
        {"timestamp": "2023-11-14T23:13:20.000000005+01:00"},
        {"timestamp": "2023-11-14T22:13:20.000000005"},
        {"timestamp": 1_700_000_000_000_000_005},
    ],
)
def test_every_way_to_say_when_gives_one_stamp(tmp_path, stamp):
    path = json_log(tmp_path / "t.mcap", [(START, START, stamp | {"x": 1})] * 2)
    assert read(path).frames["/j"]["stamp"].to_list() == [START + 5] * 2


@pytest.mark.parametrize(
    ("begin", "a_second"),
    [
        (12.5, 1), (450_000_000, 1000), (1.1e8, 1e6), (26 * 10**13, SECOND), (2e10, 1e6),
        (1_800_000_000, 10**6), (1_800_000_000_000, SECOND), (133 * 10**15, 10**7),
    ],
    ids=["s", "ms of the week", "110 s in us", "3 days in ns", "6 hours in us", "30 min in us",
         "30 min in ns", "100 ns since 1601"],
)  # fmt: skip
def test_counters_are_no_clocks(tmp_path, begin, a_second):
    """Even those whose numbers look like seconds or milliseconds of this century."""
    messages = [
        (START + k * SECOND // 10, START, {"timestamp": begin + k * a_second / 10})
        for k in range(100)
    ]
    found = read(json_log(tmp_path / "t.mcap", messages)).frames["/j"]
    assert found["stamp"].null_count() == 100


@pytest.mark.parametrize("a_second", [1, 10**3, 10**6, SECOND])
@pytest.mark.parametrize("pace", [1, 30, 1000, 3600], ids=lambda pace: f"{pace} times")
def test_a_number_is_unix_time_in_the_unit_of_its_date(tmp_path, a_second, pace):
    """However much faster than the voyage the recorder wrote."""
    messages = [
        (START + k * SECOND // 10 // pace, 0, {"timestamp": (START + k * SECOND // 10) * a_second
         // SECOND if a_second > 1 else 1_700_000_000 + k / 10})
        for k in range(100)
    ]  # fmt: skip
    found = read(json_log(tmp_path / "t.mcap", messages)).frames["/j"]["stamp"].to_numpy()
    assert found == pytest.approx(START + np.arange(100) * SECOND // 10, abs=1000)


def test_the_unit_of_a_number_is_that_of_the_whole_topic(tmp_path, monkeypatch):
    """A receiver's first stamps, before it has a fix, and damaged ones are in no other unit."""
    monkeypatch.setattr(salvage, "BATCH_BYTES", 500)
    stamps = [START // 1000 + k * 10**5 for k in range(60)]
    stamps[:20] = [k * 10**5 for k in range(20)]
    stamps[40], stamps[50] = 2 * 10**17, START
    path = json_log(
        tmp_path / "t.mcap", [(START + k, START, {"timestamp": s}) for k, s in enumerate(stamps)]
    )
    expected = [1000 * stamp if stamp < 10**17 else None for stamp in stamps]
    assert read(path).frames["/j"]["stamp"].to_list() == expected
