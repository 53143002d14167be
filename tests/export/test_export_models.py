"""Models in other programs' files: each sails the schedule that `simulate` sails."""

import json
import re
import shutil
import zipfile
from dataclasses import replace
from xml.etree import ElementTree as xml

import numpy as np
import pytest
from commands import call

from shiplog.export import (
    c_source,
    compilers,
    fmu,
    fmu_description,
    fmu_variables,
    mss,
    pvs,
    python_file,
    trial,
)
from shiplog.export.filled import inert
from shiplog.export.job import Job
from shiplog.training.runs import load_model

SAME = 1e-9  # m, m/s, rad: the files have the form of the model, so only rounding differs


def exported(run, to, out, *more):
    """The JSON of `shiplog export`; skips where the consumer is not installed."""
    said = out.with_suffix(".json")
    code, text, error = call("export", run, "--to", to, "--out", out, "--json", said, *more)
    assert code == 0, error
    answer = json.loads(said.read_text())
    if not answer["loaded"]:
        assert answer["not_loaded_because"] in text
        pytest.skip(answer["not_loaded_because"])
    assert f"{answer['greatest_difference']:.2g}" in text
    return answer


LONG = pytest.mark.long


@pytest.mark.parametrize(
    ("run", "to"),
    [
        *(("steered", to) for to in ("cpp", "fmu", "fmu3")),
        *(pytest.param("steered", to, marks=LONG) for to in ("python", "mss")),
        *(pytest.param("whole", to, marks=LONG) for to in ("cpp", "python", "mss", "fmu", "fmu3")),
    ],
)
def test_it_sails_as_simulate_does(request, run, to, tmp_path):
    """With gear, load and current, and without; the published model by Heun's method."""
    folder = request.getfixturevalue(run)
    ending = {"cpp": "h", "python": "py", "mss": "m"}.get(to, "fmu")
    answer = exported(folder, to, tmp_path / f"ship.{ending}")
    assert answer["greatest_difference"] < SAME and answer["seconds"] == 600.0
    assert set(answer["differences"]) == {"x0", "y0", "heading", "surge", "sway", "yaw_rate"}
    if to == "cpp":  # what was compared is in the file
        kept = (tmp_path / "ship.h").read_text()
        assert "Sailed again by gcc" in kept and "from shiplog simulate over 600 s" in kept


def test_the_trial_moves_all_that_drives_the_ship(whole):
    """Else the difference would say nothing of it."""
    job = Job(load_model.load(whole))
    assert np.ptp(job.trial.orders, axis=0).min() > 0.1
    assert np.hypot(*job.trial.water.wind) > 0.0 < np.hypot(*job.trial.water.current)
    turned = job.trial.reference[:, 4]
    assert np.isfinite(job.trial.reference).all() and np.ptp(turned) > 0.5


def test_a_difference_is_seen(whole):
    """A state that is off in one instant of one channel."""
    job = Job(load_model.load(whole))
    states = np.array(job.trial.reference[1:])
    assert trial.difference(job.trial, states).same
    states[300, 3] += 2e-9
    found = trial.difference(job.trial, states)
    assert not found.same and found.by_channel["sway"] == pytest.approx(2e-9)


@pytest.mark.long
@pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
def test_a_header_is_c99_and_cpp11_without_a_warning(whole, tmp_path):
    from shiplog.export import compilers

    exported(whole, "cpp", tmp_path / "ship.h")
    name = "whole"
    program = f'#include "ship.h"\nint main() {{ {name}_ship s; {name}_parameters p;' \
        f" {name}_input u; double x[6] = {{0}}; memset(&u, 0, sizeof u); {name}_defaults(&p);" \
        f" {name}_begin(&s, &p, x, 0); return {name}_step(&s, &p, &u); }}\n"  # fmt: skip
    (tmp_path / "main.txt").write_text(program)
    for language, standard in (("c", "c99"), ("c++", "c++11")):
        flags = ["-Wall", "-Wextra", "-Werror", f"-std={standard}", "-x", language, "-c"]
        compilers.run(["gcc", *flags, "main.txt", "-o", "main.o"], tmp_path)


def test_a_python_file_sails_members_and_other_coefficients(whole, tmp_path):
    out = tmp_path / "ship.py"
    python_file.write(Job(load_model.load(whole)), out, [])
    known = {}
    exec(out.read_text(), known)
    many = known["Ship"](surge=np.array([0.3, 0.4, 0.5]))
    alone = known["Ship"](surge=0.4)
    for _ in range(50):
        many.step({"rudder_port": np.array([0.1, 0.2, 0.3])})
        alone.step({"rudder_port": 0.2})
    assert many.state[:, 1] == pytest.approx(alone.state, abs=1e-12)
    assert len(set(many.state[1])) == 3 and not many.diverged.any()
    heavy = known["Ship"](surge=0.4, coefficients={"body.m_x": 1.0})
    heavy.step()
    assert heavy.state[1] != alone.state[1]
    with pytest.raises(KeyError, match="no coefficient"):
        known["Ship"](coefficients={"body.other": 1.0})


@pytest.mark.long
@pytest.mark.skipif(mss.octave() is None, reason="Octave is not installed")
def test_the_derivative_of_mss_is_over_ground(whole, tmp_path):
    """In a current it is that of still water, of the motion through it, and what the turning of
    the axes makes of the current: d/dt (Rᵀ c) = (r v_c, -r u_c)."""
    from shiplog.export import compilers

    exported(whole, "mss", tmp_path / "vessel.m")
    (tmp_path / "check.m").write_text(
        "x = [0.4 0.05 0.02 3 -2 0.7]'; ui = [0.1 -0.1 9]'; w = [1.0; -0.5];\n"
        "f = fopen('out.bin', 'w'); fwrite(f, vessel(x, ui, 0.1, 0.4, w), 'double');\n"
        "c = 0.1 * [cos(0.4 - 0.7); sin(0.4 - 0.7)];\n"
        "wet = vessel(x - [c; zeros(4, 1)], ui, 0, 0, w + 0.1 * [cos(0.4); sin(0.4)]);\n"
        "hand = wet(1:3) + x(3) * [c(2); -c(1); 0];\n"
        "fwrite(f, [hand; 0.4 * cos(0.7) - 0.05 * sin(0.7); 0.4 * sin(0.7) + 0.05 * cos(0.7); "
        "0.02], 'double');\n"
    )
    compilers.run([mss.octave(), "--norc", "--quiet", "check.m"], tmp_path)
    found, hand = np.frombuffer((tmp_path / "out.bin").read_bytes()).reshape(2, 6)
    assert found == pytest.approx(hand, abs=1e-14) and abs(found[2]) > 1e-4


# ---------------------------------------------------------------- refused


def test_what_is_refused(whole, tmp_path):
    code, _, said = call("export", whole, "--to", "fmi")
    assert code == 2 and "did you mean 'fmu'" in said
    code, _, said = call("export", whole, "--to", "onnx", "--out", tmp_path / "a.onnx")
    assert code == 1 and "no network" in said and "--to fmu" in said
    code, _, said = call("export", whole, "--to", "mss", "--out", tmp_path / "my ship.m")
    assert code == 2 and "my ship" in said and "whole.m" in said
    code, _, said = call("export", whole, "--to", "cpp", "--out", tmp_path / "no" / "a.h")
    assert code == 1 and "no folder" in said
    code, _, said = call("export", whole, "--to", "cpp", "--voyages", "voyage_1")
    assert code == 2 and "no voyage is part of it" in said
    assert not list(tmp_path.iterdir())


def test_a_model_that_is_not_the_same_ends_with_3(whole, tmp_path, monkeypatch):
    apart = trial.Difference({"x0": 2e-9}, 600.0)
    monkeypatch.setattr(python_file, "compare", lambda *_: apart)
    code, text, _ = call("export", whole, "--to", "python", "--out", tmp_path / "ship.py")
    assert code == 3 and "not the same model" in text and "x0 2e-09 m" in text


def test_texts_of_strangers_end_no_comment(steered):
    """Names of a ship and a run, in every language."""
    evil = 'a*/ """ \\ @NAME@ <b>\n#error \'x\' %} \u2028'
    ship = replace(Job(load_model.load(steered)).ship, ship=evil, run=evil, label=evil)
    assert re.fullmatch(r"[A-Za-z]\w*", ship.identifier, re.ASCII)
    compile(pvs.text(ship, np.ones(3), [evil]), "ship.py", "exec")
    for line in mss.text(ship, "vessel", [evil]).splitlines():
        assert "#error" not in line and "@" not in line.replace("@ (", "")
    header = c_source.header(ship, [evil])
    assert "#error" not in header and header.count("/*") == header.count("*/")
    described = fmu_description.fmi2(ship, fmu_variables.of_ship(ship), "{1}", inert(evil))
    assert xml.fromstring(described).get("modelName") == evil.replace("\n", "?").replace(
        "\u2028", "?"
    )


def test_without_a_compiler_it_holds_the_sources(steered, tmp_path, monkeypatch):
    monkeypatch.setattr(compilers, "own", lambda: None)
    monkeypatch.setattr(compilers, "zig", lambda: None)
    monkeypatch.setattr(fmu, "_compiled", {})
    code, text, _ = call("export", steered, "--to", "fmu", "--out", tmp_path / "ship.fmu")
    assert code == 0 and "sources alone" in text and "Not loaded by its consumer" in text
    with zipfile.ZipFile(tmp_path / "ship.fmu") as archive:
        assert not [name for name in archive.namelist() if name.startswith("binaries/")]
        assert "sources/fmi2.c" in archive.namelist()


def test_names_are_structured_as_fmi_has_them(steered):
    """Words of letters, digits and _, which begin with a letter, with points between."""
    names = [one.name for one in fmu_variables.of_ship(Job(load_model.load(steered)).ship)]
    assert "coefficient.rudder_lag_0" in names and "coefficient.hull.y_v" in names
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*", name) for name in names)


def test_an_fmu_names_no_place_and_no_host(steered, tmp_path):
    """The same run gives the same bytes, and none of them is of this machine."""
    out, again = tmp_path / "one.fmu", tmp_path / "two.fmu"
    job = Job(load_model.load(steered))
    for path in (out, again):
        fmu.write(job, path, [])
    assert out.read_bytes() == again.read_bytes()
    with zipfile.ZipFile(out) as archive:
        names = archive.namelist()
        assert {"modelDescription.xml", "sources/fmi2.c", "sources/ship.h"} <= set(names)
        for name in names:
            data = archive.read(name)
            for word in (b"/tmp", b"/home", b"/root", b"/work", b"http://", str(steered).encode()):
                assert word not in data, (name, word)
            for host in data.split(b"https://")[1:]:
                assert host.startswith(b"open-simulation-platform.com/OspModelDescription"), name
