"""docs/use/export.md in the Open Simulation Platform: what stands there is what runs here."""

import re
import zipfile
from pathlib import Path

import numpy as np
import pytest

from shiplog.export import fmu
from shiplog.export.fmpy_sailing import Names, sail
from shiplog.export.job import Job
from shiplog.nomenclature.channels import STATE
from shiplog.training.runs import load_model

PAGE = Path(__file__).parents[2] / "docs" / "use" / "export.md"
RUDDER = 0.17  # rad, of the scenario


def block(language, word):
    """The code of the page in this language that has the word."""
    (found,) = [
        code for code in re.findall(rf"^```{language}\n(.*?)^```", PAGE.read_text("utf-8"),
                                    re.MULTILINE | re.DOTALL) if word in code
    ]  # fmt: skip
    return found


def test_the_page_runs_as_it_stands(steered, tmp_path, monkeypatch):
    """The leader goes as it does under FMPy, and the follower has its rudder."""
    pytest.importorskip("libcosimpy", reason="libcosimpy is not installed")
    pytest.importorskip("fmpy", reason="FMPy is not installed")
    job = Job(load_model.load(steered))
    fmu.write(job, tmp_path / "ship.fmu", [])
    with zipfile.ZipFile(tmp_path / "ship.fmu") as archive:
        groups = archive.read("resources/OspModelDescription.xml")
    (tmp_path / f"{job.run.name}_OspModelDescription.xml").write_bytes(groups)
    (tmp_path / "OspSystemStructure.xml").write_text(block("xml", "OspSystemStructure"))
    (tmp_path / "scenario.json").write_text(block("json", "events"))
    monkeypatch.chdir(tmp_path)
    known = {}
    exec(compile(block("python", "from_osp_config_file"), PAGE.name, "exec"), known)
    inputs = tuple(one.name for one in job.ship.inputs)
    orders = np.tile([one.approach for one in job.ship.inputs], (60, 1))
    begun = 10  # the inner step that begins with the order
    orders[begun:, inputs.index("rudder_port")] = RUDDER
    start = np.array([0.0, job.ship.speed, 0.0, 0.0, 0.0, 0.0])
    names = Names(fmu.here(), tuple(c.name for c in STATE), inputs, job.ship.step)
    end = sail(tmp_path / "ship.fmu", names, start, (0.0,) * 4, orders)[-1]
    assert known["found"] == pytest.approx([*end[[0, 2, 4]], RUDDER], abs=1e-9)
    follower = known["execution"].slave_index_from_instance_name("follower")
    which = [known["place"][name] for name in known["names"]]
    x0, _, heading, rudder = known["display"].last_real_values(follower, which)
    assert rudder == RUDDER and abs(heading) > 0.05 and x0 < known["found"][0]
