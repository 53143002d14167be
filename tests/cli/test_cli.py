"""The commands as a user types them: answers, exit codes, and messages for what can be mended."""

import csv
import json
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import sailing
from commands import call

from pipelines.experiments import simulated_ship
from shiplog import cli
from shiplog.cli import app
from shiplog.commands import train as training
from shiplog.report.result import Answer

FAST = ("--window", "40", "--width", "12", "--epochs", "8")


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Three short voyages of the simulated ship."""
    folder = tmp_path_factory.mktemp("logs")
    for number in range(1, 4):
        voyage = simulated_ship.sail(150.0, seed=number, wind=simulated_ship.Wind(2.0, number))
        start = datetime(2026, 5, number, 12, 0, tzinfo=UTC)
        simulated_ship.write_voyage(
            folder / f"trip_{number}.mcap", voyage, seed=number, start=start
        )
    return folder


@pytest.fixture(scope="module")
def store(logs, tmp_path_factory):
    path = tmp_path_factory.mktemp("work") / "store"
    code, _, _ = call("ingest", logs, "--store", path)
    assert code == 0
    return path


@pytest.fixture(scope="module")
def run(store, trained_here):
    out = store.parent / "run"
    code, reported, _ = call("train", "--store", store, "--out", out, "--seeds", 2, *FAST)
    assert code == 0 and "Split by" in reported
    return out


def test_ingest_answers_as_the_contract_says_and_is_idempotent(logs, store, tmp_path):
    answer = tmp_path / "a.json"
    code, reported, _ = call("ingest", logs, "--store", store, "--json", answer)
    assert code == 0
    content = json.loads(answer.read_text())
    assert content["contract"] == 1
    assert [v["name"] for v in content["voyages"]] == ["trip_1", "trip_2", "trip_3"]
    voyage = content["voyages"][0]
    assert set(voyage) > {"name", "messages", "rows", "seconds", "findings"}
    assert voyage["messages"]["lost"] == 0 and voyage["rows"] == pytest.approx(1500, abs=5)
    assert voyage["usable_s"] == pytest.approx(150, abs=1) and voyage["windows"] == 1
    assert "trip_1" in reported


def test_voyages_lists_the_store(store):
    code, reported, _ = call("voyages", "--store", store)
    assert code == 0
    assert reported.count("trip_") == 3 and "known ship" in reported


def test_voyages_lists_those_that_are_named(store):
    code, reported, _ = call("voyages", "--store", store, "--voyages", "trip_[13]", "--json", "-")
    assert code == 0
    assert [v["name"] for v in json.loads(reported)["voyages"]] == ["trip_1", "trip_3"]
    assert call("voyages", "--store", store, "--voyages", "trp_1")[0] == 1


def test_a_draft_can_be_had_as_json(logs, tmp_path):
    code, text, _ = call("profile", logs / "trip_1.mcap")
    assert code == 0
    code, reported, _ = call("profile", logs / "trip_1.mcap", "--json", "-")
    assert code == 0
    assert json.loads(reported) == {"contract": 1, "profile": text[:-1], "written": None}
    out, to = tmp_path / "p.toml", tmp_path / "a.json"
    assert call("profile", logs / "trip_1.mcap", "--out", out, "--json", to)[0] == 0
    assert json.loads(to.read_text()) == {"contract": 1, "profile": out.read_text(),
                                          "written": str(out)}  # fmt: skip


def test_json_to_stdout_is_json_alone(store):
    code, reported, _ = call("voyages", "--store", store, "--json", "-")
    assert code == 0 and len(json.loads(reported)["voyages"]) == 3


def test_evaluate_answers_as_the_contract_says(run, store, tmp_path):
    answer = tmp_path / "e.json"
    code, reported, _ = call("evaluate", run, "--store", store, "--json", answer)
    assert code == 0
    content = json.loads(answer.read_text())
    assert set(content) == {"contract", "loss", "windows", "seeds", "rmse", "end_position_m",
                            "end_heading_deg", "floors", "voyages", "band_90", "winds",
                            "sentence", "judgement", "too_short", "contradictions", "trust",
                            "residual_tests"}  # fmt: skip
    assert content["loss"] == pytest.approx(np.mean(content["seeds"]))
    assert len(content["seeds"]) == 2 and content["windows"] == 3
    assert set(content["floors"]) == {"hold", "least_squares"}
    (voyage,) = content["voyages"].values()
    assert set(voyage) == {"loss", "windows", "coverage"}
    assert "baseline: hold the velocity" in reported


def test_evaluate_agrees_with_a_rollout_done_by_hand(run, store):
    """L of one window from errors.parquet, integrated again from rollouts and the 1 Hz rows."""
    from shiplog.voyages.store.store import Store

    call("evaluate", run, "--store", store)
    errors = pl.read_parquet(run / "errors.parquet").filter(
        (pl.col("window") == 1) & (pl.col("seed") == 0)
    )
    voyage = errors["voyage"][0]
    rollout = pl.read_parquet(run / "rollouts.parquet").filter(
        (pl.col("window") == 1) & (pl.col("seed") == 0)
    )
    whole = Store(store)
    rows = whole.seconds([voyage], whole.profile([voyage]))
    second = pl.col("elapsed").round().cast(pl.Int64).alias("second")
    both = rollout.with_columns(pl.col("time").round().cast(pl.Int64).alias("second")).join(
        rows.with_columns(second), on="second", suffix="_measured"
    )
    assert both.height == 40
    d = sum(
        (w * (both[c] - both[f"{c}_measured"])) ** 2
        for c, w in (("surge", 100), ("sway", 100), ("yaw_rate", 10 * 180 / np.pi))
    ).to_numpy()
    assert errors["loss"][0] == pytest.approx(float(np.trapezoid(d)))


def test_compare_saves_a_recording_of_both_sides(run, store, tmp_path):
    from rerun.chunk import RrdReader

    path = tmp_path / "c.rrd"
    code, _, _ = call("compare", run, "--store", store, "--save", path)
    assert code == 0
    reported = str(RrdReader(str(path)).store().summary())
    assert all(word in reported for word in ("measured", "simulated", "hist", "error"))


def test_a_finished_run_is_not_trained_over(run, store):
    code, _, reported = call("train", "--store", store, "--out", run, *FAST)
    assert code == 1 and "exists already" in reported


@pytest.mark.parametrize(
    ("expected_code", "arguments", "expected"),
    [
        (2, ("--model", "feedfoward"), "did you mean 'feedforward'"),
        (2, ("--data", "sli3"), "--data can be"),
        (2, ("--recipe", "papr"), "did you mean 'paper'"),
        (1, ("--voyages", "trp_1"), "did you mean 'trip_1'"),
        (1, ("--window", "400"), "No voyage has a window of 400 s"),
        (1, ("--voyages", "trip_1", "--validation", "trip_2", "--window", "400"),
         "longer than every"),
    ],
)  # fmt: skip
def test_a_wrong_choice_names_the_right_ones(store, tmp_path, expected_code, arguments, expected):
    code, _, reported = call("train", "--store", store, "--out", tmp_path / "r", *arguments)
    assert code == expected_code and expected in reported
    assert not list(tmp_path.iterdir())


def test_usage_errors_exit_with_2():
    assert call("train")[0] == 2
    assert call("no-such-command")[0] == 2


@pytest.mark.parametrize("command", ["demo", "check", "ingest", "convert", "profile", "voyages",
                                     "train", "evaluate", "compare"])  # fmt: skip
def test_every_command_has_help_with_an_example(command):
    code, reported, _ = call(command, "--help")
    assert code == 0 and f"Example: shiplog {command}" in " ".join(reported.split())


def test_the_list_of_commands_has_whole_sentences():
    code, reported, _ = call("--help")
    listed, _, codes = reported.partition("Commands:")[2].partition("Exit codes:")
    listed = listed.split("\n")[1:]
    assert all(f"{code} " in codes for code in (0, 1, 2, 3, 4))
    lines = [line for line in listed if line.strip()]
    assert code == 0 and len(lines) == len(app.COMMANDS)
    assert all(line.endswith(".") and not line.endswith("...") for line in lines)


@pytest.mark.parametrize("command", ["", *sorted(c.__name__ for c in app.COMMANDS)])
def test_help_is_whole_at_60_columns(command, monkeypatch, capsys):
    """The same words as in a wide terminal, and no line that is wider than it."""
    words = []
    for width in (60, 200):
        monkeypatch.setenv("COLUMNS", str(width))
        assert cli.run([*filter(None, [command]), "--help"]) == 0
        reported = capsys.readouterr().out
        assert all(len(line) <= width for line in reported.splitlines())
        words.append(reported.split())
    assert words[0] == words[1]


def test_versions_and_the_short_word_for_help():
    code, reported, _ = call("--version")
    assert code == 0 and reported.startswith("shiplog 0.") and "Rerun 0." in reported
    for command in ((), ("check",)):
        assert call(*command, "-h")[:2] == call(*command, "--help")[:2]


def test_a_bad_log_does_not_stop_the_others(logs, tmp_path):
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(b"not an mcap file at all")
    store = tmp_path / "store"
    code, _, reported = call("ingest", bad, logs / "trip_1.mcap", "--store", store)
    assert code == 3 and "bad.mcap" in reported
    assert call("voyages", "--store", store)[1].count("trip_1") == 1
    code, _, reported = call("ingest", bad, "--store", tmp_path / "other")
    assert code == 1 and not (tmp_path / "other").exists()


def test_no_store_is_an_empty_list_to_a_machine_and_a_message_to_a_reader(tmp_path):
    code, reported, said = call("voyages", "--store", tmp_path / "none", "--json", "-")
    assert code == 1 and json.loads(reported) == {"contract": 1, "voyages": []}
    assert "There is no store" in said and not (tmp_path / "none").exists()


def test_an_unforeseen_fault_in_one_log_does_not_stop_the_others(logs, tmp_path, monkeypatch):
    """Its trace is kept, and its sentence says where."""
    from shiplog.commands import prepare

    def broken(path, profile):
        if path.stem == "trip_1":
            raise ZeroDivisionError("of a kind that nobody foresaw")
        return ingest(path, profile)

    ingest = prepare.ingest
    monkeypatch.setattr(prepare, "ingest", broken)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    code, _, reported = call("ingest", logs, "--store", tmp_path / "store")
    assert code == 3 and "trip_1.mcap refused" in reported and "ZeroDivisionError" in reported
    assert "Traceback" not in reported
    (trace,) = (tmp_path / "cache").rglob("*.txt")
    assert str(trace) in reported and "in broken" in trace.read_text()
    names = [v["name"] for v in json.loads(call("voyages", "--store", tmp_path / "store",
                                                "--json", "-")[1])["voyages"]]  # fmt: skip
    assert names == ["trip_2", "trip_3"]


def test_the_same_name_with_other_content_is_refused_by_name(logs, store, tmp_path):
    clash = tmp_path / "trip_1.mcap"
    clash.write_bytes((logs / "trip_2.mcap").read_bytes())
    code, _, reported = call("ingest", clash, "--store", store)
    assert code == 1 and "another log as the voyage 'trip_1'" in reported


def test_an_unknown_log_without_a_profile_says_how_to_draft_one(tmp_path):
    path = sailing.write(tmp_path / "turn.mcap")
    code, _, reported = call("ingest", path, "--store", tmp_path / "store")
    assert code == 1 and "shiplog profile" in reported and "/gyro" in reported
    draft = tmp_path / "draft.toml"
    assert call("profile", path, "--out", draft)[0] == 0
    text = draft.read_text()
    assert 'topic = "/position"' in text and "CHECK" in text


def test_a_truncated_log_is_ingested_as_far_as_it_goes_and_exits_with_3(tmp_path):
    whole = (Path(__file__).parents[2] / "sample_logs" / "voyage_5.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: len(whole) // 2])
    code, _, _ = call("ingest", cut, "--store", tmp_path / "s", "--json", tmp_path / "a.json")
    (voyage,) = json.loads((tmp_path / "a.json").read_text())["voyages"]
    assert code == 3
    assert 300.0 < voyage["seconds"] < 800.0
    assert "truncated" in [f["kind"] for f in voyage["findings"]]
    code, reported, _ = call("check", cut)
    assert code == 3 and "truncated" in reported


def test_check_says_why_sensors_were_not_held_against_each_other(logs, tmp_path, caplog):
    """It is no error: the health of the log is reported all the same."""
    caplog.set_level("INFO")
    strange = sailing.write(tmp_path / "turn.mcap")
    for arguments, why in (
        (("check", strange), "No shipped profile fits turn.mcap"),
        (("check", logs / "trip_1.mcap", "--profile", "blueboat"), "trip_1.mcap has no topic"),
    ):
        caplog.clear()
        code, reported, _ = call(*arguments)
        assert code == 0 and "messages read, 0 lost" in reported
        (line,) = [r.getMessage() for r in caplog.records]
        assert "sensors not held against each other" in line and why in line


def test_check_takes_a_profile_and_says_where_there_is_none(logs, tmp_path, caplog):
    caplog.set_level("INFO")
    path = sailing.write(tmp_path / "turn.mcap", sailing.series(400.0))
    mine = tmp_path / "mine.toml"
    mine.write_text(sailing.PROFILE)
    code, _, _ = call("check", path, "--profile", mine)
    assert code == 0 and not caplog.records
    code, _, reported = call("check", path, "--profile", "esso-vectwn")
    assert code == 1 and "did you mean 'esso-vectwin'" in reported


def test_tables_become_logs_and_come_back_as_they_were(tmp_path):
    t = np.arange(0.0, 30.0, 0.1)
    table = pl.DataFrame(
        {
            "run_id": ["z1"] * 300, "t_s": t, "x0_m": 0.5 * t, "y0_m": np.zeros(300),
            "psi_deg": np.full(300, -3.0), "u_body_mps": np.full(300, 0.5),
            "v_body_mps": np.full(300, 0.01), "r_degps": np.zeros(300),
            "delta_deg": np.full(300, 5.0), "n_rps": np.full(300, 10.0),
        }
    )  # fmt: skip
    table.write_csv(tmp_path / "zigzag.csv")
    code, _, _ = call("convert", tmp_path / "zigzag.csv", "--profile", "kvlcc2", "--out", tmp_path)
    assert code == 0
    code, _, _ = call("ingest", tmp_path / "z1.mcap", "--profile", "kvlcc2", "--store",
                      tmp_path / "store")  # fmt: skip
    assert code == 0
    (path,) = (tmp_path / "store").rglob("table.parquet")
    back = pl.read_parquet(path)
    assert back["x0"].to_numpy() == pytest.approx(0.5 * t)
    assert back["heading"].to_numpy() == pytest.approx(np.radians(-3.0))
    assert back["rudder"].to_numpy() == pytest.approx(np.radians(-5.0))  # port is negative here
    assert back["propeller"].to_numpy() == pytest.approx(10.0)


def test_servo_pulses_become_commands_about_their_neutral(tmp_path):
    count = 200
    columns = {
        name: [0.0] * count for name in ("x_ned", "y_ned", "yaw", "surge", "sway", "yaw_rate")
    }
    pulses = {"thr_left": [1711.0] * count, "thr_right": [1311.0] * count}
    stamps = {"original_timestamp": [100.0 * i for i in range(count)], "run_id": ["7"] * count}
    pl.DataFrame(stamps | columns | pulses).write_parquet(tmp_path / "b.parquet")
    assert (
        call("convert", tmp_path / "b.parquet", "--profile", "blueboat", "--out", tmp_path)[0] == 0
    )
    assert call("ingest", tmp_path / "7.mcap", "--store", tmp_path / "store")[0] == 0
    (path,) = (tmp_path / "store").rglob("table.parquet")
    back = pl.read_parquet(path)
    # Half astern on both: the column "left" is the starboard unit, whose pulses run the other way.
    assert back["thruster_starboard"].to_numpy() == pytest.approx(-0.5)
    assert back["thruster_port"].to_numpy() == pytest.approx(-0.5)
    assert (back["quality"] == 0).all()


def test_a_table_without_a_column_names_it(tmp_path):
    with (tmp_path / "t.csv").open("w", newline="") as file:
        csv.writer(file).writerows([["t_s", "x0_m"], [0.0, 1.0]])
    code, _, reported = call(
        "convert", tmp_path / "t.csv", "--profile", "kvlcc2", "--out", tmp_path
    )
    assert code == 1 and "no column for" in reported and "heading" in reported
    assert not list(tmp_path.glob("*.mcap"))


def test_the_demo_needs_its_logs(tmp_path, monkeypatch):
    empty = tmp_path / "empty"
    empty.mkdir()
    code, _, reported = call("demo", "--no-view", "--logs", empty, "--out", tmp_path / "demo")
    assert code == 1 and "No log in" in reported


@pytest.mark.parametrize("named", [(), ("--model", "feedforward")])
def test_train_without_a_model_says_which_one_and_which_to_begin_with(
    store, tmp_path, monkeypatch, named
):
    """Before the work; whoever names the model knows."""
    monkeypatch.setattr(training, "train_command", lambda *_: Answer((), {}))
    code, _, told = call("train", "--store", store, "--out", tmp_path / "run", *named)
    assert code == 0
    assert ("trains feedforward" in told and "--model mmg" in told) == (not named)


def test_a_window_is_seconds_or_auto(store, tmp_path, monkeypatch):
    given = []
    monkeypatch.setattr(training, "train_command", lambda *a: given.append(a[2]) or Answer((), {}))
    for word in ("40", "auto"):
        out = tmp_path / word
        assert call("train", "--store", store, "--out", out, "--window", word)[0] == 0
    assert [one.window for one in given] == [40, "auto"]


def test_auto_is_resolved_before_the_run_is_made(store, tmp_path, monkeypatch):
    """3 m at less than 0.6 m/s: 100 s, which the run has in its settings."""
    made = []
    monkeypatch.setitem(
        training.FLOWS, "physics",
        (training.choose_physical_split, lambda *a: made.append(a[2]) or Answer((), {})),
    )  # fmt: skip
    call("train", "--model", "mmg", "--store", store, "--out", tmp_path / "r", "--window", "auto")
    assert [one.window for one in made] == [100]
