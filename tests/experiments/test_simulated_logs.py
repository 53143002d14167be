"""The simulated ship's instruments and logs."""

import itertools
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from simulated_voyages import START, antenna_path, local, topics

import shiplog
from pipelines.experiments import simulated_ship
from pipelines.experiments.simulated_ship import (
    LIMITS,
    Effects,
    Ship,
    Wind,
    sail,
    write_voyage,
)
from pipelines.experiments.simulated_ship.sample_logs import PLANS, SEASONS
from pipelines.experiments.simulated_ship.sensors import DATUM, Blemishes
from pipelines.experiments.simulated_ship.ship import ANTENNA

pytestmark = pytest.mark.long  # simulated ships of the experiments; the product has its own tests


def test_the_instruments_err_as_much_as_they_say(tmp_path):
    voyage = sail(1000.0, seed=21, wind=Wind(3.0, 2.0))
    write_voyage(tmp_path / "a.mcap", voyage, seed=3, start=START)
    found = topics(tmp_path / "a.mcap")

    for measured, true in zip(local(found), antenna_path(voyage), strict=True):
        error = measured - np.interp(found["/gnss/fix"]["t"], voyage.time, true)
        assert np.std(error) == pytest.approx(0.02, rel=0.3)
    velocity = found["/gnss/velocity"]
    truth = [
        np.interp(velocity["t"], voyage.time, np.gradient(path, voyage.time))
        for path in antenna_path(voyage)  # the lever arm's share of the speed comes with the path
    ]
    course = np.deg2rad(velocity["cog_deg"])
    for part, true in zip((np.cos(course), np.sin(course)), truth, strict=True):
        error = velocity["sog_mps"] * part - true
        assert np.std(error) == pytest.approx(0.01, rel=0.2) and abs(np.mean(error)) < 0.002
    gyro = found["/gyro"]
    for name, true, sigma in (("heading_deg", "heading", 0.1), ("yaw_rate_degps", "yaw_rate", 0.1)):
        error = gyro[name] - np.rad2deg(np.interp(gyro["t"], voyage.time, getattr(voyage, true)))
        assert np.std((error + 180) % 360 - 180) == pytest.approx(sigma, rel=0.2)
    wind = found["/wind/apparent"]
    error = wind["speed_mps"] - np.interp(wind["t"], voyage.time, voyage.wind_speed)
    assert np.std(error) == pytest.approx(0.1, rel=0.2)

    rates = {topic: (len(c["t"]) - 1) / (c["t"][-1] - c["t"][0]) for topic, c in found.items()}
    assert rates == {
        "/gnss/fix": pytest.approx(10, rel=1e-3), "/gnss/velocity": pytest.approx(10, rel=1e-3),
        "/gyro": pytest.approx(10, rel=1e-3), "/wind/apparent": pytest.approx(4, rel=1e-3),
        "/rudder/port": pytest.approx(10, rel=1e-3), "/propeller/main": pytest.approx(5, rel=1e-3),
        "/rudder/starboard": pytest.approx(10, rel=1e-3),
    }  # fmt: skip
    for columns in found.values():
        assert columns["late"].min() > 2e6 and columns["late"].max() < 45e6


def test_coloured_noise_is_as_large_and_lasts_longer(tmp_path):
    found = []
    for share in (0.0, 0.7):
        voyage = sail(900.0, seed=21, wind=Wind(3.0, 2.0), effects=Effects(coloured=share))
        write_voyage(tmp_path / "a.mcap", voyage, seed=3, start=START)
        gyro = topics(tmp_path / "a.mcap")["/gyro"]
        true = np.rad2deg(np.interp(gyro["t"], voyage.time, voyage.yaw_rate))
        found.append(gyro["yaw_rate_degps"] - true)
    white, coloured = found
    assert np.std(coloured) == pytest.approx(np.std(white), rel=0.15)
    lasting = [np.corrcoef(error[5:], error[:-5])[0, 1] for error in found]  # half a second
    assert lasting[0] < 0.25 and 0.45 < lasting[1] < 0.8


def test_jittered_clocks_misstamp_and_nothing_else(logs):
    _, clean = logs()
    _, found = logs(Effects(clock_jitter=0.012))
    for topic, columns in found.items():
        off = columns["t"] - clean[topic]["t"]
        assert np.std(off) == pytest.approx(0.012, rel=0.15)
        assert (np.diff(columns["t"]) > 0).all()
        arrived = columns["t"] + columns["late"] / 1e9
        assert arrived == pytest.approx(clean[topic]["t"] + clean[topic]["late"] / 1e9, abs=1e-6)
        for name in set(columns) - {"t", "late"}:
            assert np.array_equal(columns[name], clean[topic][name], equal_nan=True)


def test_blemishes_are_where_they_were_put(logs):
    _, clean = logs()
    _, found = logs(blemishes=Blemishes(dropouts=((30.0, 3.0),), spikes=((60.04, 2.0, -1.0),)))
    for topic in ("/gnss/fix", "/gnss/velocity"):
        gap = np.diff(found[topic]["t"])
        assert gap.max() == pytest.approx(3.1) and np.sum(gap > 0.2) == 1
    kept = np.isin(clean["/gnss/fix"]["t"], found["/gnss/fix"]["t"])
    off = [far - near[kept] for far, near in zip(local(found), local(clean), strict=True)]
    assert np.sum(np.hypot(*off) > 0.01) == 1
    assert [o[np.argmax(np.hypot(*off))] for o in off] == pytest.approx([2.0, -1.0], abs=0.002)


def test_a_log_is_the_same_bytes_again(tmp_path):
    for name in ("a.mcap", "b.mcap"):
        voyage = sail(30.0, seed=1, wind=Wind(2.0, 0.0))
        write_voyage(tmp_path / name, voyage, seed=1, start=START)
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_the_profile_is_of_this_ship():
    profile = Path(shiplog.__file__).parent / "profiles" / "esso-vectwin.toml"
    facts = tomllib.loads(profile.read_text())
    ship = Ship()
    assert facts["ship"] == {
        "name": ship.name, "length_m": ship.length, "breadth_m": ship.breadth,
        "draught_m": ship.draught, "mass_kg": ship.mass, "x_g_m": ship.gravity_ahead,
        "block_coefficient": ship.block_coefficient, "frontal_area_m2": ship.frontal_area,
        "lateral_area_m2": ship.lateral_area,
    }  # fmt: skip
    for channel in ("position", "velocity"):
        assert facts["sensors"][channel]["lever_arm_m"] == list(ANTENNA)
    limits = {
        a["name"]: tuple(np.deg2rad(a["limits"]) if a["kind"] == "rudder" else a["limits"])
        for a in facts["actuators"]
    }
    assert limits == {name: pytest.approx(pair) for name, pair in LIMITS.items()}
    assert facts["site"]["datum"] == list(DATUM)


def test_the_sample_logs_are_small_and_complete():
    folder = Path(simulated_ship.__file__).parents[3] / "sample_logs"
    names = {f"{plan.name}.mcap" for plan in (*PLANS, *itertools.chain(*SEASONS.values()))}
    assert {p.name for p in folder.glob("*.mcap")} == names
    assert sum(p.stat().st_size for p in folder.glob("*.mcap")) <= 22_000_000


def test_the_samples_hide_two_things_nothing_and_something_outside_the_catalogue():
    folder = Path(simulated_ship.__file__).parents[3] / "sample_logs"
    key = json.loads((folder / "answers" / "key.json").read_text("utf-8"))
    reported = {voyage: [cause["name"] for cause in causes] for voyage, causes in key.items()}
    wanted = {2: ["current", "clock_offset"], 3: [], 4: ["tether"]}
    assert reported == {f"season{s}_{k}": names for s, names in wanted.items() for k in (1, 2)}
    listing = " ".join(p.name for p in folder.iterdir()) + (folder / "README.md").read_text("utf-8")
    assert not [word for names in reported.values() for word in names if word in listing]
