"""The main job on the sample logs, with a training of a few iterations."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from commands import call
from rerun.chunk import RrdReader

from shiplog.commands import demo
from shiplog.diagnosis.hypotheses import search
from shiplog.exceptions import ShiplogError
from shiplog.machine.paths import sample_logs
from shiplog.training.settings.run_config import Fast
from shiplog.voyages.store.store import Store

pytestmark = pytest.mark.usefixtures("trained_here")
VOYAGES = [f"voyage_{i}" for i in range(1, 7)]


def test_the_sample_logs_are_six_voyages_and_three_seasons():
    seasons = [f"season{i}_{k}" for i in (2, 3, 4) for k in (1, 2)]
    assert sorted(path.stem for path in sample_logs(None).glob("*.mcap")) == [*seasons, *VOYAGES]


def test_logs_without_the_season_that_is_diagnosed_are_refused_before_the_training(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(demo, "train_run", None)
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "voyage_1.mcap").symlink_to(sample_logs(None) / "voyage_1.mcap")
    with pytest.raises(ShiplogError, match=r"no log season2_\* was ingested"):
        demo.run_demo(tmp_path / "demo", tmp_path / "logs")


@pytest.mark.parametrize(("complete", "code"), [(True, 0), (False, 3)])
def test_the_demo_exits_with_3_where_a_log_is_not_whole(tmp_path, monkeypatch, complete, code):
    made = demo.Demo("done", {"refused": {}}, tmp_path / "a.rrd", complete)
    monkeypatch.setattr(demo, "run_demo", lambda *_: made)
    assert call("demo", "--no-view", "--out", tmp_path / "demo")[0] == code


def few_logs(folder: Path) -> Path:
    """The six voyages, and of the seasons half of the one that the demo diagnoses."""
    folder.mkdir()
    for path in sample_logs(None).glob("*.mcap"):
        if path.stem in (*VOYAGES, "season2_1"):
            (folder / path.name).symlink_to(path)
    return folder


def test_the_demo_ends_with_a_recording_of_both_sides_and_resumes(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(demo, "SEEDS", (0,))
    monkeypatch.setattr(demo, "RECIPE", Fast(iterations=4, warm_epochs=2))
    monkeypatch.setattr(search, "MOST_SETS", 3)  # what a verdict says is tested elsewhere
    logs = few_logs(tmp_path / "logs")
    (logs / "bad.mcap").write_bytes(b"no log")
    first = demo.run_demo(tmp_path / "demo", logs)
    assert list(first.json["refused"]) == [str(logs / "bad.mcap")] and not first.complete
    assert f"rerun --bind 127.0.0.1 {first.recording}" in first.text
    assert "bad.mcap refused" in caplog.text
    output = str(RrdReader(str(first.recording)).store().summary())
    for word in ("/track/voyage_6/measured", "/track/voyage_6/simulated", "/hist/wind/training",
                 "/error/voyage_6", "/state/voyage_6/surge/measured", "/report"):  # fmt: skip
        assert word in output, word
    names = {e.name: e.findings for e in Store(tmp_path / "demo" / "store").entries()}
    assert sorted(names) == ["season2_1", *VOYAGES]
    # What its README says is wrong with voyage_4: two spikes, and no GNSS for three seconds,
    # which position and velocity both lack.
    assert names["voyage_4"] == 4 and sum(names.values()) == 4
    ref, doubled = first.json["runs"]["ref"], first.json["runs"]["d-ref"]
    assert ref["windows"] == doubled["windows"] == 12
    assert ref["voyages"]["voyage_6"]["coverage"] < 0.5
    assert "not in the training data: wind" in first.text
    json.dumps(first.json)

    trained = (
        (tmp_path / "demo" / "runs" / "ref" / "seed0" / "model.safetensors").stat().st_mtime_ns
    )
    # a diagnosis is made again, for a minute, and what it says is tested elsewhere
    output = SimpleNamespace(sentence="as before", as_json=dict)
    drawn = [True, False]  # the second diagnosis, of the extended model, has no pictures
    monkeypatch.setattr(
        demo, "diagnose_run",
        lambda *_, **__: SimpleNamespace(verdict=output, drawn=drawn.pop(0)),
    )  # fmt: skip
    (logs / "bad.mcap").unlink()
    again = demo.run_demo(tmp_path / "demo", logs)
    assert drawn == [] and not again.json["refused"] and not again.complete
    assert again.json["runs"] == first.json["runs"]
    path = tmp_path / "demo" / "runs" / "ref" / "seed0" / "model.safetensors"
    assert path.stat().st_mtime_ns == trained
