"""The figures of .docs/findings.md that take no minutes, against answers found by other means."""

import numpy as np
import polars as pl
import pytest

from pipelines.convert import convert
from pipelines.findings import kvlcc2, milliampere
from pipelines.prepare import expand, ingest_logs
from shiplog import parity
from shiplog import profile as profiles
from shiplog.store import Store


@pytest.mark.shared
def test_a_berthing_says_that_its_yaw_rate_is_late(shared_data, tmp_path):
    source = shared_data / "frt-ds-esso" / "berthing" / "berthing_12-Nov-2020_11_14_47.parquet"
    convert([source], profiles.load("esso-osaka"), tmp_path / "logs")
    store = Store(tmp_path / "store")
    ingest_logs(expand([tmp_path / "logs"]), "esso-osaka", store)
    rows = store.tables([source.stem])[0].collect()
    (late,) = (
        e for e in parity.estimates(rows, store.profile([source.stem]))
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
        lambda text: float(text.strip("%")), milliampere._follows(folder, 3)
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
