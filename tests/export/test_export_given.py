"""A simulator of one's own with causes around it, in files of other programs."""

import hashlib
import json
import re
import runpy
import shutil
import zipfile
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import tanker
from commands import call

from shiplog.exceptions import UnreadableError
from shiplog.export import fmu, given_unit, python_file
from shiplog.export.job import Job
from shiplog.foreign.source import Source
from shiplog.training.runs import load_model

GEAR = {
    "current": [0.05, -0.03], "payload": [40.0, 10.0], "rudder_offset": [0.02, -0.01],
    "rudder_lag": [1.3], "rudder_delay": [1.7],
}  # fmt: skip
SAME = 1e-9  # m, m/s, rad: the layer has the form of `simulate`, so only rounding differs


def exported(run, file, to, out):
    said = out.with_suffix(".json")
    code, text, error = call("export", run, "--to", to, "--out", out, "--json", said,
                             "--simulator", file)  # fmt: skip
    assert code == 0, error
    answer = json.loads(said.read_text())
    if not answer["loaded"]:
        pytest.skip(answer["not_loaded_because"])
    return answer, text


@pytest.mark.long
@pytest.mark.parametrize(
    ("kind", "to"),
    [
        ("fmu", "fmu"), ("fmu3", "fmu3"), ("function", "python"),
        pytest.param("exchange", "fmu3", marks=pytest.mark.nightly),
    ],
)  # fmt: skip
def test_it_sails_as_simulate_does(caused, kind, to, tmp_path):
    """Current, load, and an offset, a lag and a delay of the rudders, around each kind."""
    if kind != "function":
        pytest.importorskip("fmpy", reason="FMPy is not installed")
    run, file = caused(kind, **GEAR)
    answer, text = exported(run, file, to, tmp_path / "ship.fmu")
    assert answer["greatest_difference"] < SAME and answer["seconds"] == 600.0
    assert f"{answer['greatest_difference']:.2g}" in text
    if kind == "function":
        assert any("takes its function as an argument" in one for one in answer["not_in_it"])
        return
    assert any("as you gave it in this call" in one for one in answer["not_in_it"])
    # its own step of 0.02 s against one of 1 s, and no states besides the ship's
    (by_itself,) = [one for one in answer["not_in_it"] if "goes on by itself" in one]
    metres, degrees = map(float, re.findall(r"([\d.]+) (?:m|deg)\b", by_itself)[:2])
    assert 0.01 < metres < 3.0 and 0.01 < degrees < 3.0
    with zipfile.ZipFile(tmp_path / "ship.fmu") as whole, zipfile.ZipFile(file) as given:
        for name in given.namelist():
            assert whole.read(f"resources/given/{name}") == given.read(name)
        facts = json.loads(whole.read("resources/shiplog.json"))
        source = whole.read("sources/given.h").decode()
    assert facts["given"] == {
        "name": "given.fmu", "sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
    }  # fmt: skip
    assert facts["given"]["sha256"] in source and "GIVEN\n" not in source


class Unit:
    """The FMU that was written, by FMPy."""

    def __init__(self, path, folder):
        import fmpy
        from fmpy.fmi2 import FMU2Slave

        described = fmpy.read_model_description(str(path), validate=True)
        self.places = {v.name: v.valueReference for v in described.modelVariables}
        self.fmu = FMU2Slave(
            guid=described.guid, unzipDirectory=fmpy.extract(str(path), str(folder)),
            instanceName="ship", modelIdentifier=described.coSimulation.modelIdentifier,
        )  # fmt: skip

    def begin(self, **start):
        self.fmu.instantiate()
        for name, value in start.items():
            self.put(f"start.{name}", value)
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def put(self, name, value):
        self.fmu.setReal([self.places[name]], [value])

    def state(self):
        names = ("x0", "surge", "y0", "sway", "heading", "yaw_rate")
        return np.array(self.fmu.getReal([self.places[one] for one in names]))

    def sail(self, seconds, step=1.0, begun=0.0):
        for k in range(round(seconds / step)):
            self.fmu.doStep(currentCommunicationPoint=begun + k * step, communicationStepSize=step)
        return self.state()


@pytest.fixture
def unit(caused, tmp_path):
    pytest.importorskip("fmpy", reason="FMPy is not installed")
    run, file = caused("fmu", current=[0.05, -0.03])
    fmu.write(Job(load_model.load(run, simulators=[str(file)])), tmp_path / "ship.fmu", [])
    made = Unit(tmp_path / "ship.fmu", tmp_path / "a folder %41 ü")
    yield made
    made.fmu.freeInstance()


def in_still_water(start, actuators, seconds, h=0.05):
    """The tanker's own equations by Runge and Kutta's rule, with actuators that stand."""

    def rate(x):
        u, v = x[1], x[3]
        wind = (np.hypot(u, v), np.arctan2(v, u))  # in calm of one that moves
        return tanker.f(x, (*actuators, *wind), 0.0)

    x = np.array(start)
    for _ in range(round(seconds / h)):
        k1 = rate(x)
        k2 = rate(x + 0.5 * h * k1)
        k3 = rate(x + 0.5 * h * k2)
        x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + rate(x + h * k3))
    return x


def test_a_current_carries_it(unit):
    """Galilei: in a current V with the wind of the same, a path is that in still water, carried by
    V t. The file is opened from a folder with spaces, per cent signs and umlauts."""
    water, turned = np.array([0.05, -0.03]), (0.2, 0.2, 8.0)
    unit.begin(surge=0.5 + water[0], sway=water[1])
    for axis, value in zip(("x0", "y0"), -water, strict=True):
        unit.put(f"wind.{axis}", value)  # where it comes from: it blows with the water
    for name, value in zip(("rudder_port", "rudder_starboard", "propeller"), turned, strict=True):
        unit.put(f"rate.{name}", 1e9)
        unit.put(f"order.{name}", value)
    found = unit.sail(60.0)
    alone = in_still_water([0.0, 0.5, 0.0, 0.0, 0.0, 0.0], turned, 60.0)
    assert abs(alone[4]) > 0.5
    assert found[[0, 2]] - 60.0 * water == pytest.approx(alone[[0, 2]], abs=0.05)
    assert found[[4, 5]] == pytest.approx(alone[[4, 5]], abs=0.01)


def test_its_state_is_the_ships_alone(unit):
    """The given FMU keeps no state of its own: kept, set and serialised it goes on the same, at
    communication steps of any length."""
    unit.begin(surge=0.4)
    unit.put("order.rudder_port", 0.3)
    unit.sail(7.0)
    kept = unit.fmu.getFMUstate()
    first = unit.sail(5.0, begun=7.0)
    unit.fmu.setFMUstate(kept)
    assert np.array_equal(unit.sail(5.0, step=0.25, begun=7.0), first)
    unit.fmu.setFMUstate(unit.fmu.deSerializeFMUstate(unit.fmu.serializeFMUstate(kept)))
    assert np.array_equal(unit.sail(5.0, step=0.5, begun=7.0), first)


def test_without_what_is_inside_it_is_refused(unit):
    shutil.rmtree(Path(unit.fmu.unzipDirectory) / "resources" / "given")
    with pytest.raises(Exception, match="nstantiate"):
        unit.begin()
    unit.fmu.freeInstance = lambda: None  # there is none


def test_the_python_asks_the_function_itself(caused, tmp_path):
    """With the user's own function in this process, and two ships at once."""
    run, file = caused("function", **GEAR)
    opened = load_model.load(run, simulators=[str(file)])
    python_file.write(Job(opened), tmp_path / "ship.py", [])
    known, f = runpy.run_path(str(tmp_path / "ship.py")), runpy.run_path(str(file))["f"]
    positions = {"rudder_port": 0.3, "rudder_starboard": 0.2, "propeller": 8.0}
    table = pl.DataFrame({"time": [0.0, 40.0], **{k: [v, v] for k, v in positions.items()}})
    sailed = opened.simulate(table, {"surge": 0.5})
    ships = known["Ship"](
        f, surge=np.array([0.5, 0.3]), y0=np.array([0.0, 100.0]), recorded=True
    )  # fmt: skip
    for _ in range(40):
        ships.step(positions)
    end = sailed.tail(1).select("x0", "surge", "y0", "sway", "heading", "yaw_rate").row(0)
    assert ships.state[:, 0] == pytest.approx(end, abs=1e-12)
    assert ships.state[2, 1] > 50.0


@pytest.mark.parametrize(
    ("kind", "to", "words"),
    [
        ("fmu", "cpp", "--to fmu and fmu3 have it inside"),
        ("fmu", "onnx", "--to fmu and fmu3 have it inside"),
        ("function", "fmu", "needs Python"),
        ("function", "mss", "--to python writes the causes around it"),
        ("function", "toml", "--to csv and yaml have those of its causes"),
    ],
)
def test_what_cannot_be_written_is_refused(caused, tmp_path, kind, to, words):
    if kind == "fmu":
        pytest.importorskip("fmpy", reason="FMPy is not installed")
    run, file = caused(kind, **GEAR)
    code, _, said = call("export", run, "--to", to, "--out", tmp_path / "x", "--simulator", file)
    assert code == 1 and words in said and not (tmp_path / "x").exists()


def test_the_simulator_is_given_by_hand(caused, wrapped, tmp_path):
    run, file = caused("function", **GEAR)
    out = tmp_path / "ship.py"
    code, _, said = call("export", run, "--to", "python", "--out", out)
    assert code == 1 and "keeps no code of it" in said and "--simulator" in said
    other = tmp_path / file.name
    other.write_text(file.read_text() + "\n")
    code, _, said = call("export", run, "--to", "python", "--out", out, "--simulator", other)
    assert code == 1 and "is not the simulator that" in said and not out.exists()
    plain, _ = wrapped("function")
    code, _, said = call("export", plain, "--to", "csv", "--out", out, "--simulator", file)
    assert code == 1 and "has no coefficients of shiplog's" in said


def test_numbers_and_predictions_of_it(caused, sailed, tmp_path):
    run, file = caused("function", **GEAR)
    answer, _ = exported(run, file, "csv", tmp_path / "n.csv")
    assert answer["greatest_difference"] == 0.0
    assert "rudder_lag" in (tmp_path / "n.csv").read_text()
    out = tmp_path / "p.parquet"
    given = ("--store", sailed / "store", "--voyages", "voyage_1")
    code, _, said = call("export", run, "--to", "parquet", "--out", out, *given)
    assert code == 1 and "keeps no code of it" in said
    code, text, said = call("export", run, "--to", "parquet", "--out", out, *given,
                            "--simulator", file)  # fmt: skip
    assert code == 0 and "differs by 0 at most" in text, said


def test_files_of_a_strangers_archive_stay_in_it(tmp_path):
    file = tmp_path / "odd.fmu"
    with zipfile.ZipFile(file, "w") as odd:
        odd.writestr("modelDescription.xml", "")
        odd.writestr("../evil.txt", "")

    def unit(sha256):
        source = Source(file, "fmu", "", sha256)
        return given_unit.Unit(source, 2, False, {}, {}, ())

    with pytest.raises(UnreadableError, match="which is outside of it"):
        _ = unit(hashlib.sha256(file.read_bytes()).hexdigest()).content
    with pytest.raises(UnreadableError, match="was changed meanwhile"):
        _ = unit("0" * 64).content
    assert re.fullmatch(r"[\w.{}\\-]*", given_unit._text('{a-1}"; */ @NAME@\n\\ü').replace(" ", ""))
