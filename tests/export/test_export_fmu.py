"""An FMU as its importers use it: steps of any length, states kept, refusals."""

import json
import zipfile

import numpy as np
import pytest
from commands import call

from shiplog.export import fmu, fmu_variables
from shiplog.export.job import Job
from shiplog.export.trial import difference
from shiplog.training.runs import load_model

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed")
STATES = ("x0", "y0", "heading", "surge", "sway", "yaw_rate")


@pytest.fixture(scope="module", params=["2", "3"])
def unit(request, steered, tmp_path_factory):
    """Extracted FMU of each version: its description and its folder."""
    folder = tmp_path_factory.mktemp("unit")
    job = Job(load_model.load(steered))
    fmu.write_unit(job.ship, folder / "ship.fmu", [], request.param)
    if not any(name.startswith("binaries/") for name in
               zipfile.ZipFile(folder / "ship.fmu").namelist()):  # fmt: skip
        pytest.skip("no C compiler is installed")
    described = fmpy.read_model_description(str(folder / "ship.fmu"), validate=True)
    return described, fmpy.extract(str(folder / "ship.fmu"), str(folder / "out"))


class Sailing:
    """One instance, from second 100 on."""

    def __init__(self, unit, logged=None):
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        described, folder = unit
        self.three = described.fmiVersion.startswith("3")
        make = FMU3Slave if self.three else FMU2Slave
        self.fmu = make(
            guid=described.guid, unzipDirectory=folder, instanceName="ship",
            modelIdentifier=described.coSimulation.modelIdentifier,
        )  # fmt: skip
        self.places = {v.name: v.valueReference for v in described.modelVariables}
        self.fmu.instantiate()
        self.put("start.surge", 0.4)
        if self.three:
            self.fmu.enterInitializationMode(startTime=100.0)
        else:
            self.fmu.setupExperiment(startTime=100.0)
            self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def put(self, name, value):
        (self.fmu.setFloat64 if self.three else self.fmu.setReal)([self.places[name]], [value])

    def get(self):
        which = [self.places[name] for name in STATES]
        return np.array((self.fmu.getFloat64 if self.three else self.fmu.getReal)(which))

    def step(self, at, seconds):
        self.put("order.rudder_port", 0.3 * np.sin(0.1 * np.floor(at - 100.0 + 1e-6)))
        self.fmu.doStep(currentCommunicationPoint=at, communicationStepSize=seconds)

    def sail(self, steps):
        """Time → state."""
        found, at = {}, 100.0
        for seconds in steps:
            self.step(at, seconds)
            at += seconds
            found[round(at, 6)] = self.get()
        return found


@pytest.fixture
def sailing(unit):
    made = []

    def begin():
        made.append(Sailing(unit))
        return made[-1]

    yield begin
    for one in made:
        one.fmu.freeInstance()


@pytest.mark.parametrize(
    "steps", [[0.25] * 160, [0.1] * 400, [0.7, 0.3] * 40, [0.5, 0.25, 0.25] * 40]
)
def test_the_communication_step_changes_nothing(sailing, steps):
    """Inner steps begin at whole seconds and hold what was set then."""
    each = sailing().sail([1.0] * 40)
    found = sailing().sail(steps)
    both = sorted(set(each) & set(found))
    assert len(both) >= 13
    for at in both:
        assert np.array_equal(each[at], found[at]), at


def test_between_two_inner_steps_it_moves_on(sailing):
    """Place and heading by the trapezoidal rule over what has passed of the step."""
    found = sailing().sail([0.5] * 21)
    path = np.array([found[100.5 + 0.5 * k][0] for k in range(21)])
    assert (np.diff(path) > 0.0).all()
    half = found[110.5]
    assert found[110.0][3] != half[3]


def test_a_state_is_kept_and_set_again(sailing):
    ship = sailing()
    ship.sail([1.0] * 7 + [0.4])
    kept = ship.fmu.getFMUState() if ship.three else ship.fmu.getFMUstate()
    ship.step(107.4, 5.0)
    first = ship.get()
    (ship.fmu.setFMUState if ship.three else ship.fmu.setFMUstate)(kept)
    ship.step(107.4, 5.0)
    assert np.array_equal(ship.get(), first)
    serialise = ship.fmu.serializeFMUState if ship.three else ship.fmu.serializeFMUstate
    back = ship.fmu.deserializeFMUState if ship.three else ship.fmu.deSerializeFMUstate
    again = sailing()
    other = back(serialise(kept))
    (again.fmu.setFMUState if ship.three else again.fmu.setFMUstate)(other)
    again.step(107.4, 5.0)
    assert np.array_equal(again.get(), first)


def test_what_it_refuses(sailing):
    ship = sailing()
    ship.step(100.0, 1.0)
    with pytest.raises(Exception, match=r"doStep|DoStep"):
        ship.fmu.doStep(currentCommunicationPoint=150.0, communicationStepSize=1.0)
    for name, value in (("order.rudder_port", np.nan), ("x0", 1.0), ("start.x0", 1.0),
                        ("rate.propeller", 0.0)):  # fmt: skip
        with pytest.raises(Exception, match=r"[sS]et"):
            sailing().put(name, value)


def test_a_coefficient_is_changed_on_the_way(sailing):
    """As a master does that identifies one."""
    plain, other = sailing(), sailing()
    plain.sail([1.0] * 3)
    other.step(100.0, 1.0)
    other.put("coefficient.hull.x_0f", -0.05)
    other.step(101.0, 1.0)
    other.step(102.0, 1.0)
    assert other.get()[3] < plain.get()[3]


def test_libcosim_sails_as_simulate_does(steered, tmp_path):
    """The importer of the Open Simulation Platform: FMI 2.0 alone."""
    pytest.importorskip("libcosimpy", reason="libcosimpy is not installed")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    job = Job(load_model.load(steered))
    fmu.write(job, tmp_path / "ship.fmu", [])
    sail = job.trial
    place = {one.name: i for i, one in enumerate(fmu_variables.of_ship(job.ship))}
    execution = CosimExecution.from_step_size(int(job.ship.step * 1e9))
    slave = execution.add_local_slave(CosimLocalSlave(str(tmp_path / "ship.fmu"), "ship"))
    for name, value in zip(sail.names, sail.start, strict=True):
        execution.real_initial_value(slave, place[f"start.{name}"], float(value))
    hand, eye = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(hand)
    execution.add_observer(eye)
    water = [place[n] for n in ("wind.x0", "wind.y0", "current.x0", "current.y0")]
    hand.slave_real_values(slave, water, [*sail.water.wind, *sail.water.current])
    orders = [place[f"order.{one.name}"] for one in job.ship.inputs]
    found = []
    for row in sail.orders:
        hand.slave_real_values(slave, orders, row.tolist())
        execution.step()
        found.append(eye.last_real_values(slave, [place[n] for n in sail.names]))
    assert difference(sail, np.array(found)).greatest < 1e-9


def test_fmuloader_sails_as_simulate_does(steered, tmp_path):
    """Another importer of FMI 3.0, which asks for all of its functions."""
    pytest.importorskip("fmuloader", reason="fmuloader is not installed")
    from fmuloader.fmi3 import Fmi3Slave

    job = Job(load_model.load(steered))
    fmu.write_unit(job.ship, tmp_path / "ship.fmu", [], "3")
    described = fmpy.read_model_description(str(tmp_path / "ship.fmu"))
    place = {one.name: one.valueReference for one in described.modelVariables}
    ship, sail = Fmi3Slave(tmp_path / "ship.fmu", model_identifier=job.ship.identifier), job.trial
    ship.instantiate_co_simulation("ship", instantiation_token=described.guid)
    ship.set_float64([place[f"start.{n}"] for n in sail.names], sail.start.tolist())
    water = [place[n] for n in ("wind.x0", "wind.y0", "current.x0", "current.y0")]
    ship.set_float64(water, [*sail.water.wind, *sail.water.current])
    ship.enter_initialization_mode(start_time=0.0)
    ship.exit_initialization_mode()
    found = []
    for k, row in enumerate(sail.orders):
        ship.set_float64([place[f"order.{one.name}"] for one in job.ship.inputs], row.tolist())
        ship.do_step(k * job.ship.step, job.ship.step)
        found.append(ship.get_float64([place[n] for n in sail.names]))
    ship.terminate()
    ship.free_instance()
    assert difference(sail, np.array(found)).greatest < 1e-9


def test_its_page_says_what_was_compared(steered, tmp_path):
    assert call("export", steered, "--to", "fmu", "--out", tmp_path / "ship.fmu")[0] == 0
    with zipfile.ZipFile(tmp_path / "ship.fmu") as archive:
        facts = json.loads(archive.read("resources/shiplog.json"))
        page = archive.read("documentation/index.html").decode()
        osp = archive.read("resources/OspModelDescription.xml").decode()
    assert "FMPy" in facts["compared"][0] and facts["compared"][0] in page.replace("&#x27;", "'")
    assert 'ref="order.rudder_port"' in osp and "LinearVelocity" in osp
