"""`shiplog watch` on short voyages: a replay, a source of another ship, a stop and what follows."""

from __future__ import annotations

import json
import threading

import numpy as np
import polars as pl
import pytest
from commands import call

from shiplog.commands.watch import Reporter, watch_command
from shiplog.live.session import Watch
from shiplog.live.sources.base import Arrived
from shiplog.simulation import rollout
from shiplog.training.runs import load_model
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.split import plan

DAY = 1_777_640_400_000_000_000


@pytest.fixture(scope="module")
def replayed(published, store, logs, tmp_path_factory):
    out = tmp_path_factory.mktemp("watched")
    code, printed, _ = call(
        "watch", logs / "trip_3.mcap", "--run", published[0], "--store", store, "--out", out,
        "--json", "-",
    )  # fmt: skip
    assert code == 0
    return [json.loads(line) for line in printed.splitlines()], out


def test_a_replay_ends_with_the_file(replayed):
    lines, _ = replayed
    assert lines[0]["kind"] == "start" and "fitted to no voyage" in lines[0]["why"]
    end = lines[-1]
    assert (end["kind"], end["alarms"], end["could_alarm"]) == ("end", 0, False)
    assert end["rows"] > 700  # of 80 s
    assert not [line for line in lines if line["kind"] == "alarm"]


def test_the_error_is_that_of_the_run_s_own_rollouts(replayed, published, store):
    """Of windows that are cut from the stored voyage, as `evaluate` does."""
    run, name = load_model.load(published[0]), "trip_3"
    kept = Store(store)
    profile = kept.profile([name])
    seconds = kept.seconds([name], profile)
    size = run.config.window
    cut = windows.cut(
        seconds, plan(seconds, "ref", size), size, profile.actuator_names, profile.wind_names
    )
    error = rollout.simulate(next(iter(run.models().values())), cut)[0] - cut.state[0]
    expected = np.hypot(error[:, 0], error[:, 2])[1:]
    points = [line for line in replayed[0] if line["kind"] == "point" and not line["provisional"]]
    found = {}
    for line in points[: 3 * size]:
        if line["since_s"] == int(line["since_s"]):
            found.setdefault(int(line["since_s"]), line["position_m"])
    shown = [found[k] for k in range(1, size - 1)]
    assert shown == pytest.approx(expected[: size - 2].tolist(), rel=2e-4, abs=1e-4)


def test_nothing_is_kept_but_in_its_own_folder(replayed, logs):
    _, out = replayed
    assert sorted(p.name for p in logs.iterdir()) == [f"trip_{n}.mcap" for n in (1, 2, 3)]
    tables = [pl.read_parquet(path) for path in (out / "rows").glob("*.parquet")]
    assert sum(table.height for table in tables) > 700


class Given:
    """A source of what it is given, look by look."""

    name, live = "given", True

    def __init__(self, looks):
        self.looks = list(looks)

    def look(self, clock):
        return self.looks.pop(0) if self.looks else Arrived()

    def place(self):
        return {}

    def close(self):
        pass


def headings(first: int, seconds: int) -> pl.DataFrame:
    times = first + np.arange(10 * seconds) * 100_000_000
    return pl.DataFrame({
        "log_time": times, "publish_time": times, "stamp": times,
        "heading_deg": np.linspace(0.0, 5.0, len(times)), "yaw_rate_degps": 0.1,
    })  # fmt: skip


@pytest.mark.long
def test_a_source_without_a_channel_is_told_and_watched_on(published):
    run = load_model.load(published[0])
    of = {"voyage": {"ship": "another ship"}}
    looks = [
        Arrived({"/gyro": headings(DAY + n * 10 * 10**9, 10)}, (), of, frozenset({"/gyro"}))
        for n in range(4)
    ]
    watch = Watch(run, Given(looks))
    events = [e for step in range(40) for e in watch.step(DAY + step * 10**9)]
    sentences = [e.sentence for e in events if hasattr(e, "sentence")]
    assert any("/gnss/fix" in s and "/gyro" in s for s in sentences)
    assert any("'another ship'" in s and run.profile.ship.name in s for s in sentences)
    assert len(sentences) == len(set(sentences))  # each once, however long it lasts
    quiet = [e for step in range(4, 30) for e in watch.step(DAY + (100 + step) * 10**9)]
    assert any("given is silent" in getattr(e, "sentence", "") for e in [*events, *quiet])


@pytest.mark.long
def test_a_watch_ends_when_nothing_came_for_as_long_as_was_said(published, store, logs, tmp_path):
    """The clock is the test's: it goes on by a second with each wait."""
    path = tmp_path / "half.mcap"
    content = (logs / "trip_3.mcap").read_bytes()
    path.write_bytes(content[: len(content) // 2])
    clock, said = [DAY], []
    done = watch_command(
        str(path), published[0], Store(store), tmp_path / "out", Reporter(said.append), per_day=1.0,
        stop_after_s=20.0, now=lambda: clock[0],
        sleep=lambda _: clock.__setitem__(0, clock[0] + 10**9),
    )  # fmt: skip
    assert clock[0] - DAY >= 20 * 10**9
    assert done.json["alarms"] == 0
    assert any("silent: no message" in line for line in said)
    assert threading.active_count() < 20
