"""A ship without wind sensor: what needs the wind is not tested, all else is."""

from importlib import resources

import pytest
from contract_shape import shaped
from whole_way import hidden, log

from shiplog.commands import diagnose as pipeline
from shiplog.commands.identify import identify_run
from shiplog.commands.prepare import ingest_logs
from shiplog.diagnosis.hypotheses import search
from shiplog.training.settings.run_config import Config, Physics
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split import choose_physical_split


@pytest.mark.nightly
def test_without_wind_sensor_what_needs_it_is_not_tested(tmp_path, monkeypatch):
    """A model that nothing was fitted to, on another voyage of that season: it has absorbed
    nothing, so that all else is tested. A hull alone compiles quickly. What can be tested does not
    depend on how far the search goes."""
    monkeypatch.setattr(search, "MOST_SETS", 2)
    text = (resources.files("shiplog") / "profiles" / "esso-vectwin.toml").read_text("utf-8")
    begin = text.index("[sensors.wind]")
    profile = tmp_path / "calm.toml"
    profile.write_text(text[:begin] + text[text.index("[[actuators]]") :], encoding="utf-8")
    case = hidden("none")
    store = Store(tmp_path / "store")
    assert not ingest_logs([log(case, leg, tmp_path) for leg in case.trial], str(profile),
                           store).refused  # fmt: skip
    split = choose_physical_split(store, ("trial_1",), (), "ref", 100)
    physics = Physics(fit=False, without=("propeller", "rudder"))
    run, _ = identify_run(Config(model="mmg", split=split, physics=physics), store, tmp_path / "r")
    done = pipeline.diagnose_run(run.path, store, ["trial_2"], tmp_path / "out")
    content = done.verdict.as_json()
    shaped(content)
    assert content["base"] == {"run": "r", "before_effect": False}
    assert any("may stand for an error of its coefficients" in note for note in content["notes"])
    why = {one["name"]: one["reason"] for one in content["unavailable"]}
    for name in ("wind_force", "wind_direction_offset", "wind_speed_scale"):
        assert "no wind is recorded" in why[name]
    tested = {c.label for c in done.trial.reference.model.causes}
    assert tested >= {"current", "clock_offset:gnss", "fouling", "payload"}
    assert not tested & {"wind_force", "clock_offset:wind", "wind_speed_scale"}
    assert not any(one["name"] == "unknown:wind" for one in content["ranking"])
