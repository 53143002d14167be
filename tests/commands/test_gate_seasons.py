"""The gate on the sample logs, with the limits of its page: season 3 passes, season 2 does not. And
both seasons followed together, which are far from each other.

Where SHIPLOG_SEASONS names a folder, store, run, limits and diagnosis stay in it for what CI does
next.
"""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import pytest
from commands import call
from junitparser import JUnitXml

import shiplog

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "use" / "gate.md").read_text(encoding="utf-8")
LOGS = ("voyage_1", "voyage_2", "season2_1", "season2_2", "season3_1", "season3_2")


def block(title: str) -> str:
    """A block of the page that has this title."""
    return PAGE.split(f"<!-- {title} -->\n```", 1)[1].split("\n", 1)[1].split("```", 1)[0]


@pytest.fixture(scope="module")
def seasons(tmp_path_factory):
    """A folder with the run and the limits; each season is diagnosed into it."""
    kept = os.environ.get("SHIPLOG_SEASONS")
    folder = Path(kept) if kept else tmp_path_factory.mktemp("seasons")
    folder.mkdir(parents=True, exist_ok=True)
    logs = [ROOT / "sample_logs" / f"{name}.mcap" for name in LOGS]
    store = ("--store", folder / "store")
    assert call("ingest", *logs, *store)[0] == 0
    chosen = ("--voyages", "voyage_1", "--voyages", "voyage_2")
    assert call("train", "--model", "mmg", *store, *chosen, "--out", folder / "mmg")[0] == 0
    (folder / "limits.toml").write_text(block("limits of the sample logs"), encoding="utf-8")
    return folder


def gated(seasons: Path, number: int):
    """Exit code, states by limit, and the test suite of a season."""
    code, text, error = call(
        "gate", seasons / "mmg", "--store", seasons / "store", "--limits", seasons / "limits.toml",
        "--voyages", f"season{number}_*", "--diagnosis", seasons / f"season{number}",
        "--junit", seasons / f"season{number}.xml",
    )  # fmt: skip
    (suite,) = JUnitXml.fromfile(str(seasons / f"season{number}.xml"))
    assert text, error
    return code, states(text), suite


def states(text: str) -> dict[str, str]:
    found = re.findall(r"^(holds|broken|not assessed) +([^:\n]+):", text, re.MULTILINE)
    return {name: state for state, name in found}


def test_season_3_passes(seasons):
    code, found, suite = gated(seasons, 3)
    assert code == 0 and set(found.values()) == {"holds"}
    assert (suite.tests, suite.failures, suite.errors) == (10, 0, 0)
    assert found == states(block("season 3"))


def test_season_2_fails_for_its_current(seasons):
    """What is limited and has not changed still holds."""
    code, found, suite = gated(seasons, 2)
    assert code == 4
    assert {name for name, state in found.items() if state != "holds"} == {
        "verdict", "current.speed", "L / L of least squares", "end position after 100 s",
    }  # fmt: skip
    assert found["heading_offset"] == found["yaw_rate_bias.value"] == "holds"
    assert (suite.tests, suite.failures, suite.errors) == (10, 4, 0)
    failed = {case.name: case.result[0].message for case in suite if case.result}
    assert "A steady current of 0.1" in failed["current.speed, at most 0.03 m/s"]
    assert found == states(block("season 2"))


@pytest.mark.nightly
def test_each_voyage_of_two_seasons_has_its_own_current_and_clock(seasons):
    """What was hidden in season 2, and nothing in season 3."""
    found = shiplog.trend(
        seasons / "mmg", seasons / "store", "season*", of=["current", "clock_offset:gnss"]
    )
    key = json.loads((ROOT / "sample_logs" / "answers" / "key.json").read_text(encoding="utf-8"))
    current, clock = found.trends
    for one, other in zip(current.voyages, clock.voyages, strict=True):
        hidden = {c["name"]: c["parameters"] for c in key[one.voyage]}
        time = other.pooled["time"]
        late = hidden["clock_offset"]["time"]["value"] if hidden else 0.0
        assert time.low < late < time.high < late + 0.2
        speed, towards = one.pooled["speed"], one.pooled["direction"]
        if hidden:
            true = {name: of["value"] for name, of in hidden["current"].items()}
            assert speed.low < true["speed"] < speed.high < 0.11
            assert towards.low < true["direction"] < towards.high < true["direction"] + 5.0
        else:
            assert speed.high < 0.01
