"""Coefficients and predictions in files, read again by other programs."""

import json
import subprocess
import sys
import tomllib

import numpy as np
import polars as pl
import pytest
from commands import call
from mcap.reader import make_reader

import shiplog
from shiplog.export.yaml_file import _value


def test_coefficients_train_a_run_again(whole, sailed, tmp_path):
    """The TOML is what `train --parameters` takes."""
    out = tmp_path / "ship.toml"
    assert call("export", whole, "--to", "toml", "--out", out)[0] == 0
    code, _, said = call("train", "--store", sailed / "store", "--out", tmp_path / "again",
                         "--window", 25, "--model", "mmg", "--no-fit", "--voyages", "voyage_1",
                         "--parameters", out)  # fmt: skip
    assert code == 0, said
    one, other = shiplog.load(whole).coefficients, shiplog.load(tmp_path / "again").coefficients
    assert {n: float(c) for n, c in one.items()} == {n: float(c) for n, c in other.items()}


def test_causes_are_in_every_file_of_numbers(steered, tmp_path):
    for to in ("csv", "toml", "yaml"):
        out = tmp_path / f"ship.{to}"
        code, text, _ = call("export", steered, "--to", to, "--out", out)
        assert code == 0 and "Forces of its causes" in text
        assert "rudder_lag" in out.read_text()
    read = tomllib.loads((tmp_path / "ship.toml").read_text())
    assert set(read) == {"source", "body", "hull", "propeller", "rudder", "wind"}
    assert "# cause: rudder_lag.time = 1.3 s" in (tmp_path / "ship.toml").read_text()
    rows = pl.read_csv(tmp_path / "ship.csv").filter(pl.col("name") == "rudder_offset.port")
    assert rows["value"][0] == pytest.approx(np.degrees(0.02)) and rows["unit"][0] == "deg"


def test_a_yaml_is_read_with_its_numbers(whole, tmp_path):
    yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")
    out = tmp_path / "ship.yaml"
    assert call("export", whole, "--to", "yaml", "--out", out)[0] == 0
    read = yaml.safe_load(out.read_text())["coefficients"]
    for name, one in shiplog.load(whole).coefficients.items():
        assert read[name]["value"] == float(one)
    for number in (1e-5, -3e22, 0.1, -0.0, 1e300, 5e-324):
        assert yaml.safe_load(_value(number)) == number


@pytest.mark.parametrize(
    "to", ["parquet", *(pytest.param(to, marks=pytest.mark.long) for to in ("mcap", "csv"))]
)
def test_predictions_are_those_of_evaluate(whole, sailed, tmp_path, to):
    out, store = tmp_path / f"p.{to}", sailed / "store"
    code, text, said = call("export", whole, "--to", to, "--out", out, "--store", store,
                            "--voyages", "voyage_1")  # fmt: skip
    assert code == 0 and "differ" in text, said
    judged = shiplog.evaluate(whole, store, "voyage_1").rollouts.sort("time")
    if to == "mcap":
        found = {}
        with open(out, "rb") as stream:
            from mcap_protobuf.decoder import DecoderFactory

            reader = make_reader(stream, decoder_factories=[DecoderFactory()])
            for _, channel, message, decoded in reader.iter_decoded_messages():
                found.setdefault(channel.topic, []).append((message.log_time, decoded))
        assert {"/sim/whole/state", "/ship/state", "/wind/apparent", "/propeller/propeller"} <= \
            set(found)  # fmt: skip
        words = [sys.executable, "-m", "rerun", "mcap", "check", out]
        assert subprocess.run(words, capture_output=True, check=False).returncode == 0
        surge = [m.surge_mps for _, m in found["/sim/whole/state"]]
        stamps = [t for t, _ in found["/ship/state"]]
        assert stamps == sorted(stamps) and len(surge) == len(stamps)
        begun = shiplog.open_store(store)["voyage_1"].start
        first = np.datetime64(stamps[0], "ns").astype("datetime64[us]").item()
        assert 0.0 <= (first - begun.replace(tzinfo=None)).total_seconds() < 30.0
    else:
        table = pl.read_parquet(out) if to == "parquet" else pl.read_csv(out)
        surge = table["surge"].to_list()
        start = table.filter(pl.col("window") == 0).row(0, named=True)
        assert start["x0"] == start["measured_x0"]
    assert surge == pytest.approx(judged["surge"].to_list(), abs=1e-12)


def test_a_log_is_of_one_voyage(whole, sailed, tmp_path):
    code, _, said = call("export", whole, "--to", "mcap", "--out", tmp_path / "p.mcap",
                         "--store", sailed / "store", "--voyages", "nobody")  # fmt: skip
    assert code == 1 and "nobody" in said
    code, _, said = call("export", whole, "--to", "mcap", "--out", tmp_path / "p.mcap",
                         "--store", tmp_path)  # fmt: skip
    assert code == 1 and not (tmp_path / "p.mcap").exists()


def test_the_library_says_what_the_command_says(whole, tmp_path):
    done = shiplog.export_run(whole, "toml", tmp_path / "ship.toml")
    assert done.difference.greatest < 1e-9 and done.path.is_file() and not done.unloaded
    assert json.loads(json.dumps(done.json))["to"] == "toml" and "ship.toml" in done.text
