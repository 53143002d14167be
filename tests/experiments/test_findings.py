"""The figures of docs/evidence that take no minutes, against answers found by other means."""

import numpy as np
import polars as pl
import pytest

from pipelines.experiments.findings import faults, kvlcc2, milliampere
from shiplog.commands.convert import convert
from shiplog.commands.demo import sample_logs
from shiplog.commands.prepare import expand, ingest_logs
from shiplog.ship_profile import file as profiles
from shiplog.voyages.sensors import sensor_consistency
from shiplog.voyages.store.store import Store


@pytest.mark.shared
def test_a_berthing_says_that_its_yaw_rate_is_late(shared_data, tmp_path):
    source = shared_data / "frt-ds-esso" / "berthing" / "berthing_12-Nov-2020_11_14_47.parquet"
    convert([source], profiles.load("esso-osaka"), tmp_path / "logs")
    store = Store(tmp_path / "store")
    ingest_logs(expand([tmp_path / "logs"]), "esso-osaka", store)
    rows = store.tables([source.stem])[0].collect()
    (late,) = (
        e for e in sensor_consistency.estimates(rows, store.profile([source.stem]))
        if (e.kind, e.channel) == ("clock_offset", "yaw_rate")
    )  # fmt: skip
    assert late.notable
    # without any model: the shift at which the rate agrees best with the heading's own difference
    rate, heading = rows["yaw_rate"].to_numpy(), np.unwrap(rows["heading"].to_numpy())
    turned = np.gradient(np.convolve(heading, np.ones(11) / 11, "same"), 0.1)[60:-60]
    alike = [np.corrcoef(turned, np.roll(rate, -k)[60:-60])[0, 1] for k in range(31)]
    assert late.value == pytest.approx(0.1 * int(np.argmax(alike)), abs=0.25)


@pytest.mark.shared
def test_azimuths_follow_their_orders_late(shared_data):
    """0.6 to 0.7 s is where ordered and measured angles correlate best, unit by unit."""
    folder = shared_data / "milliampere1_physical" / "nlp1"
    _, raw, delay, left, dead, lag, both = map(
        lambda text: float(text.strip("%")), milliampere.follows(folder, 3)
    )
    order = pl.read_parquet(folder / "actuator_ref_3.parquet")
    stood = pl.read_parquet(folder / "actuators__actuator_3__azimuth_angle.parquet")
    time = np.arange(5.0, 480.0, 0.1)
    begin = order["log_time_ns"][0]
    at = [(t["log_time_ns"].to_numpy() - begin) * 1e-9 for t in (order, stood)]
    measured = np.interp(time, at[1], stood["data"].to_numpy())
    ordered = [
        np.interp(time - d, at[0], order["angle_reference"].to_numpy())
        for d in np.arange(0, 2, 0.1)
    ]
    best = 0.1 * int(np.argmax([np.corrcoef(measured, o)[0, 1] for o in ordered]))
    assert delay == pytest.approx(best, abs=0.11)
    assert both < left < 0.5 * raw
    assert dead + lag == pytest.approx(delay, abs=0.3)


@pytest.mark.shared
def test_marin_at_hsvas_scale_keeps_what_froude_keeps(shared_data):
    full = pl.read_parquet(shared_data / "kvlcc2_simman" / kvlcc2.MARIN)
    model = kvlcc2.at_model_scale(full)
    along = np.hypot(full["u_body_mps"].to_numpy(), full["v_body_mps"].to_numpy())
    small = np.hypot(model["u_body_mps"].to_numpy(), model["v_body_mps"].to_numpy())
    assert small / np.sqrt(7.0) == pytest.approx(along / np.sqrt(7.0 * 45.7), rel=1e-6)
    heading = np.unwrap(np.radians(model.filter(run_id="MARIN_FREE_KVLCC2_tc_35_m")["psi_deg"]))
    turned = model.filter(run_id="MARIN_FREE_KVLCC2_tc_35_m")
    rate = np.radians(turned["r_degps"].to_numpy())
    seconds = turned["t_s"].to_numpy()
    swept = float(np.sum(0.5 * (rate[1:] + rate[:-1]) * np.diff(seconds)))
    assert swept == pytest.approx(heading[-1] - heading[0], rel=0.03)  # the time is scaled with it


# --- faults written into measured voyages


def turning(seconds: float = 60.0) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """A ship on a circle of 10 m at 0.5 m/s, 10 Hz, its rudder a slow sine."""
    t = np.arange(0.0, seconds, 0.1)
    heading = 0.05 * t
    return t, {
        "x0": 10.0 * np.sin(heading), "y0": -10.0 * np.cos(heading), "heading": heading,
        "surge": np.full_like(t, 0.5), "sway": np.zeros_like(t), "yaw_rate": np.full_like(t, 0.05),
        "rudder_port": np.sin(0.2 * t), "rudder_starboard": np.sin(0.2 * t),
    }  # fmt: skip


def test_a_moved_antenna_moves_as_its_velocity_says():
    t, c = turning()
    faults.move_antenna(c, 0.3, -0.25)
    north, east = np.gradient(c["x0"], t), np.gradient(c["y0"], t)
    cos, sin = np.cos(c["heading"]), np.sin(c["heading"])
    inner = slice(1, -1)
    assert (cos * north + sin * east)[inner] == pytest.approx(c["surge"][inner], abs=1e-5)
    assert (cos * east - sin * north)[inner] == pytest.approx(c["sway"][inner], abs=1e-5)
    assert c["surge"][0] == pytest.approx(0.5 + 0.05 * 0.25) and c["sway"][0] == 0.05 * 0.3


def test_what_is_late_was_so_before_and_what_lags_follows():
    t, c = turning()
    faults.delay(c, t, -1.0, "rudder")
    assert c["rudder_port"][:500] == pytest.approx(np.sin(0.2 * (t[:500] + 1.0)), abs=1e-3)
    t, c = turning()
    faults.hold_back(c, t, 1.2, "rudder")
    # x = y + T y' of a sine; the averaging over three samples, twice, takes 0.03 % off
    assert c["rudder_starboard"][20:-20] == pytest.approx(
        (np.sin(0.2 * t) + 0.24 * np.cos(0.2 * t))[20:-20], abs=0.001
    )
    assert c["surge"] == pytest.approx(0.5)


def test_a_fault_is_written_into_a_voyage_of_its_own_and_nowhere_else(tmp_path):
    log = sample_logs() / "voyage_1.mcap"
    store = Store(tmp_path / "store")
    ingest_logs([log], None, store)
    profile = store.profile(["voyage_1"])
    before = store.tables(["voyage_1"])[0].collect()
    size, write = faults.FAULTS["yaw_rate_bias"]
    assert size(0.3) == "value 0.09 deg/s"
    name = faults.written(store, log, profile, "yaw_rate_bias-0.3", write, 0.3)
    assert store.select() == ["voyage_1", name]
    assert store.tables(["voyage_1"])[0].collect().equals(before)
    after = store.tables([name])[0].collect()
    assert (after["yaw_rate"] - before["yaw_rate"]).to_numpy() == pytest.approx(np.radians(0.09))
    same = [n for n in before.columns if n not in ("voyage", "yaw_rate", "heading")]
    assert after.select(same).equals(before.select(same))
    turned = np.exp(1j * (after["heading"] - before["heading"]).to_numpy())
    assert np.nanmax(np.abs(turned - 1.0)) < 1e-12
