"""Blind logs of ships of other families: what an instrument shows, and what the key alone says."""

import hashlib
import json
import math
import tomllib
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from pipelines.experiments import other_families
from pipelines.experiments.other_families import __main__ as command
from pipelines.experiments.other_families import cases, instruments
from pipelines.experiments.other_families.disturbance import CALM, Wind
from pipelines.experiments.other_families.effects import Effects
from pipelines.experiments.other_families.voyage import sail
from shiplog.ship_profile import file as profile_file

pytestmark = pytest.mark.long  # simulators of the experiments; the product has its own tests
FOLDER = Path(other_families.__file__).parent
START = datetime(2026, 5, 1, 6, 0, tzinfo=UTC)
BREEZE = Wind(3.0, 0.8)


def ship_of(family: str, seed: int = 3):
    if family == "shipmmg":
        pytest.importorskip("shipmmg")
    return cases.FAMILIES[family](seed)


def columns(voyage, e: Effects) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Topic/field → times [s] and values of the log of this voyage with these effects."""
    zero = int(START.timestamp()) * 10**9
    found = {}
    for one in instruments.measure(replace(voyage, effects=e), seed=9, start=START):
        for name, values in one.columns.items():
            found[f"{one.topic}/{name}"] = ((one.time - zero) / 1e9, np.asarray(values))
    return found


def turned(difference: np.ndarray) -> np.ndarray:
    return (difference + 180.0) % 360.0 - 180.0


def test_a_hidden_instrument_shows_exactly_its_number():
    """The same noise in both, so the difference is the effect, to the resolution of the logger."""
    ship = ship_of("abkowitz", 4)
    ship = replace(ship, sensors=replace(ship.sensors, position="local", velocity="ned"))
    v = sail(ship, 200.0, seed=2, wind=BREEZE)
    e = Effects(
        heading_offset=math.radians(3.0), yaw_rate_bias=math.radians(0.2), yaw_rate_scale=0.05,
        antenna_offset=(12.0, -3.0), wind_direction_offset=math.radians(-11.0),
        wind_speed_scale=0.2, clock_offset={"velocity": 1.3},
    )  # fmt: skip
    plain, logged = columns(v, Effects()), columns(v, e)
    times, heading = plain["/gyro/heading_deg"]
    assert turned(logged["/gyro/heading_deg"][1] - heading) == pytest.approx(3.0, abs=0.01)
    rate = np.interp(times, v.time, np.degrees(v.yaw_rate))
    extra = logged["/gyro/yaw_rate_degps"][1] - plain["/gyro/yaw_rate_degps"][1]
    assert extra == pytest.approx(0.2 + 0.05 * rate, abs=0.002)
    at, north = plain["/gnss/local/x_m"]
    psi = np.interp(at, v.time, v.heading)
    moved = logged["/gnss/local/x_m"][1] - north
    assert moved == pytest.approx(12.0 * np.cos(psi) + 3.0 * np.sin(psi), abs=0.002)
    blown, angle = plain["/wind/apparent/direction_deg"]
    assert turned(logged["/wind/apparent/direction_deg"][1] - angle) == pytest.approx(
        -11.0, abs=0.2
    )
    speed = np.hypot(*(np.interp(blown, v.time, w) for w in (v.from_ahead, v.from_starboard)))
    extra = logged["/wind/apparent/speed_mps"][1] - plain["/wind/apparent/speed_mps"][1]
    assert extra == pytest.approx(0.2 * speed, abs=0.02)
    assert logged["/rudder/rudder/angle_deg"][1] == pytest.approx(
        plain["/rudder/rudder/angle_deg"][1]
    )


def test_a_late_clock_shows_what_was():
    ship = ship_of("catamaran", 4)
    ship = replace(ship, sensors=replace(ship.sensors, position="local", velocity="ned"))
    v = sail(ship, 120.0, seed=2, wind=CALM)
    plain, late = columns(v, Effects()), columns(v, Effects(clock_offset={"gnss": 0.7}))
    for name, true in (("/gnss/local/x_m", v.x0), ("/gnss/local/y_m", v.y0)):
        at = plain[name][0]
        psi = [np.interp(at - lag, v.time, v.heading) for lag in (0.7, 0.0)]
        lever = ship.sensors.antenna[0] * (
            np.cos(psi[0]) - np.cos(psi[1]) if name.endswith("x_m") else
            np.sin(psi[0]) - np.sin(psi[1])
        )  # fmt: skip
        was = np.interp(at - 0.7, v.time, true) - np.interp(at, v.time, true)
        assert late[name][1] - plain[name][1] == pytest.approx(was + lever, abs=0.002)
    assert (late["/gyro/heading_deg"][1] == plain["/gyro/heading_deg"][1]).all()


def metadata(path: Path) -> tuple:
    with open(path, "rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        channels = sorted((c.topic, tuple(c.metadata.items())) for c in summary.channels.values())
        return channels, [(m.name, m.metadata) for m in reader.iter_metadata()]


def brief(monkeypatch):
    monkeypatch.setattr(cases, "SHORT", 300.0)
    monkeypatch.setattr(cases, "LEAST", 60.0)


@pytest.mark.parametrize("family", cases.FAMILIES)
def test_a_case_is_blind_and_readable(family, tmp_path, monkeypatch):
    """The trial with something hidden differs from the one without in its samples, nowhere else."""
    ship_of(family)
    brief(monkeypatch)
    for name, cause in (("plain", "none"), ("other", "fouling+heading_offset")):
        case = cases.draw(8, family=family, cause=cause, size=1.0, seconds=300.0)
        cases.write(case, tmp_path / name, tmp_path / "keys" / f"{name}.json")
    key = json.loads((tmp_path / "keys" / "other.json").read_text())
    assert (key["verdict"], key["family"]) == ("named", family)
    assert [c["name"] for c in key["causes"]] == ["fouling", "heading_offset"]
    assert key["structure"] is None and key["affected"] == [f"trial_{i}" for i in range(1, 6)]
    plain = {p.name: p for p in (tmp_path / "plain").iterdir()}
    other = {p.name: p for p in (tmp_path / "other").iterdir()}
    assert (
        set(plain)
        == set(other)
        == {"ship.toml"}
        | {f"{campaign}_{i}.mcap" for campaign in ("nominal", "trial") for i in range(1, 6)}
    )
    for name, path in other.items():
        content = path.read_bytes()
        if name.startswith("trial"):
            assert content != plain[name].read_bytes()
        else:
            assert content == plain[name].read_bytes()
        if name.endswith(".mcap"):
            assert hashlib.sha256(content).hexdigest() == key["sha256"][path.stem]
            assert metadata(path) == metadata(plain[name])
    loaded = profile_file.load(other["ship.toml"])
    topics = {topic for topic, _ in metadata(other["trial_1.mcap"])[0]}
    assert set(loaded.wanted()) == topics


def test_the_key_does_not_lie_with_the_logs(tmp_path, monkeypatch):
    brief(monkeypatch)
    case = cases.draw(8, family="catamaran", cause="none", seconds=60.0, nominal_seconds=60.0)
    with pytest.raises(ValueError, match="elsewhere"):
        cases.write(case, tmp_path / "logs", tmp_path / "logs" / "key.json")
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "mine.mcap").touch()
    with pytest.raises(FileExistsError, match=r"mine\.mcap"):
        cases.write(case, tmp_path / "logs", tmp_path / "key.json")


def test_what_a_ship_has_not_cannot_be_hidden_in_it(tmp_path, capsys):
    """A catamaran without rudder; names of none; and the command says so without a traceback."""
    with pytest.raises(ValueError, match="cannot have cause 'rudder_lag'"):
        cases.draw(1, family="catamaran", cause="rudder_lag")
    with pytest.raises(ValueError, match="No cause 'barnacles'"):
        cases.draw(1, family="catamaran", cause="barnacles")
    with pytest.raises(ValueError, match="the same thing twice"):
        cases.draw(1, family="catamaran", cause="thrust_loss+thrust_loss:unit")
    with pytest.raises(SystemExit) as stopped:
        command.main(["case", "1", str(tmp_path), "--key", str(tmp_path.parent / "k.json"),
                      "--family", "catamaran", "--cause", "wind_force"])  # fmt: skip
    assert stopped.value.code == 2
    assert "It offers: none, current" in capsys.readouterr().err


def test_one_unit_s_loss_is_reported_with_its_name():
    case = cases.draw(5, family="azimuth_ferry", cause="thrust_loss:unit", size=1.0)
    (cause,) = case.causes
    assert cause.name == "thrust_loss"
    unit = cause.parameters["unit"]["value"]
    assert case.ship.drives[case.effects.unit] == unit
    assert 1.0 - case.effects.unit_loss == cause.parameters["factor"]["value"]


def test_a_large_ship_has_a_longer_campaign():
    large, small = (cases.draw(3, family=f, cause="none") for f in ("abkowitz", "catamaran"))
    assert large.ship.length > 200.0
    assert sum(leg.seconds for leg in large.trial) > 8000.0
    assert sum(leg.seconds for leg in small.trial) == pytest.approx(7000.0)
    assert (large.trial[0].start - large.nominal[0].start).days == 30


def test_shipmmg_missing_is_reported(monkeypatch):
    import builtins

    real = builtins.__import__

    def without(name, *rest, **more):
        if name.startswith("shipmmg"):
            raise ImportError(name)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ValueError, match=r"pip install '\.\[experiments\]'"):
        cases.draw(1, family="shipmmg")


def test_experiments_are_not_installed():
    project = tomllib.loads((FOLDER.parents[2] / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["tool"]["setuptools"]["packages"]["find"] == {"include": ["shiplog*"]}
    assert project["project"]["optional-dependencies"]["experiments"] == [
        "numba>=0.62",
        "shipmmg",
    ]
