"""Position, heading and actuators alone train, evaluate and diagnose, as a user types it."""

import json
import tomllib
from importlib import resources
from pathlib import Path

import pytest
import tomli_w
from commands import call

pytestmark = pytest.mark.nightly
LOGS = Path(__file__).parents[2] / "sample_logs"


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """Store and run of the sample ship without its velocity and yaw rate."""
    folder = tmp_path_factory.mktemp("pose")
    text = (resources.files("shiplog") / "profiles" / "esso-vectwin.toml").read_text("utf-8")
    content = tomllib.loads(text)
    del content["sensors"]["velocity"], content["sensors"]["yaw_rate"]
    (folder / "pose.toml").write_text(tomli_w.dumps(content), encoding="utf-8")
    logs = [LOGS / f"voyage_{i}.mcap" for i in (1, 2, 3, 4)]
    logs += [LOGS / "season2_1.mcap", LOGS / "season2_2.mcap"]
    store = ("--store", folder / "store")
    code, reported, _ = call("ingest", *logs, "--profile", folder / "pose.toml", *store)
    assert code == 0
    assert "derived by a Kalman smoother" in reported
    run = folder / "run"
    code, reported, _ = call(
        "train", "--model", "mmg", "--voyages", "voyage_[1-3]", *store, "--out", run
    )
    assert code == 0
    assert "Measured: position and heading." in reported
    return folder, store, run


def test_it_predicts_held_out_voyages_and_its_bands_hold_them(trained):
    folder, store, run = trained
    to = folder / "evaluation.json"
    assert call("evaluate", run, "--voyages", "voyage_4", *store, "--json", to)[0] == 0
    answer = json.loads(to.read_text())
    assert answer["loss"] < 0.05 * answer["floors"]["hold"]
    assert answer["derived_loss"] < 0.2 * answer["loss"]
    assert [one["channel"] for one in answer["derived"]] == ["surge", "sway", "yaw_rate"]
    assert min(answer["band_90"].values()) > 0.75


def test_it_finds_what_the_second_season_hides(trained):
    """A current and a late GNSS, as `sample_logs/answers/key.json` has them."""
    folder, store, run = trained
    out = folder / "diagnosis"
    assert call("diagnose", run, "--voyages", "season2_*", *store, "--out", out)[0] == 0
    verdict = json.loads((out / "verdict.json").read_text())
    hidden = json.loads((LOGS / "answers" / "key.json").read_text())["season2_1"]
    true = {one["name"]: one["parameters"] for one in hidden}
    found = {one["name"]: one["parameters"] for one in verdict["causes"]}
    assert set(found) == set(true)
    for cause, name in (("current", "speed"), ("clock_offset", "time")):
        interval = found[cause][name]
        assert interval["low"] < true[cause][name]["value"] < interval["high"]
    assert found["clock_offset"]["channel"]["value"] == "position"  # velocity is its own change
    left = {one["name"] for one in verdict["unavailable"]}
    assert {"yaw_rate_bias", "yaw_rate_scale"} <= left
    assert "a diagnosis counts none of these" in (out / "report.md").read_text()
