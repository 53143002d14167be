"""One voyage in every recorder's format: drafted, ingested as it is, and equal to that in MCAP."""

import importlib.util
import re

import made_dataflash
import made_nmea2000 as n2k
import made_ulog
import numpy as np
import polars as pl
import pytest
from circle_layouts import DATUM, TOLERANCE, Voyage, direct, profile_of
from test_mavlink import circle as telemetry

from shiplog.commands.convert import draft
from shiplog.commands.prepare import ingest_logs
from shiplog.voyages.store.store import Store

FORMATS = {
    "boat.BIN": made_dataflash.circle,
    "boat.tlog": lambda: telemetry().log,
    "boat.ulg": made_ulog.circle,
    "boat.log": lambda: n2k.text(n2k.candump_l(n2k.circle())).encode(),
}  # fmt: skip
MOTION = ("x0", "y0", "surge", "sway", "heading", "yaw_rate")
COARSER = {"surge": 3e-3, "sway": 3e-3}  # a course in 0.01 deg or 1e-4 rad, a velocity in floats


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    profile = profile_of("position", "sog_cog", "heading", "yaw_rate")
    return direct(tmp_path_factory.mktemp("known"), profile, Voyage())


@pytest.mark.parametrize("name", FORMATS)
def test_drafted_and_ingested_it_is_the_voyage(tmp_path, known, name):
    if name.endswith("tlog") and not importlib.util.find_spec("pymavlink"):
        pytest.skip("shiplog[ardupilot]")
    path = tmp_path / name
    path.write_bytes(FORMATS[name]())
    text = re.sub(r"lever_arm_m = \[.*?\]", "lever_arm_m = [0.0, 0.0]", draft(path))
    profile = tmp_path / "boat.toml"
    profile.write_text(text.replace("length_m = 1.0", "length_m = 20.0") + "\n" + DATUM)
    store = Store(tmp_path / "store")
    done = ingest_logs([path], str(profile), store)
    assert done.complete, (done.refused, done.lost, done.damaged)
    (entry,) = store.entries()
    assert (entry.name, entry.source) == ("boat", name)
    table = pl.read_parquet(tmp_path / "store" / "voyage=boat" / "table.parquet")
    common = known.join(table, on="time", suffix="_ours")
    assert common.height > 580
    for channel in MOTION:
        off = common[f"{channel}_ours"].to_numpy() - common[channel].to_numpy()
        if channel == "heading":
            off = np.angle(np.exp(1j * off))
        assert np.nanmax(np.abs(off)) < COARSER.get(channel, TOLERANCE[channel]), channel
        assert np.isfinite(off).sum() > 580
