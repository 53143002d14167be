"""`--to fmu`, of FMI 2.0, and the parts of `--to fmu3`: a unit for co-simulation, of C alone.

modelDescription.xml   variables, units, what it can do
sources/               ship.h, component.h, and fmi2.c or fmi3.c: enough to compile it anywhere
binaries/              for this machine; with ziglang also for others, of which none is run here
resources/             shiplog.json: what was compared; OspModelDescription.xml: OSP's groups
documentation/         index.html (or index.txt): what it is
"""

from __future__ import annotations

import html
import json
import re
import uuid
import zipfile
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from shiplog.exceptions import ShiplogError, listed
from shiplog.export import (
    c_source,
    compilers,
    fmpy_sailing,
    fmu_description,
    fmu_variables,
    given_simulator,
    given_trial,
    given_unit,
)
from shiplog.export.filled import filled, inert
from shiplog.export.fmpy_sailing import Names
from shiplog.export.job import Job
from shiplog.export.ship import Ship
from shiplog.export.trial import Difference, Trial, difference
from shiplog.machine import files

CONSUMER = "FMPy"
STAMP = (1980, 1, 1, 0, 0, 0)  # of every file in it: the same run gives the same bytes
SPACE = uuid.UUID("5b3c7f52-8f0a-4d0b-9d2c-6f3c9d1f7e11")  # of the tokens of shiplog's FMUs
# Libraries that were compiled once in this process: the record in an FMU changes, its code does not
_compiled: dict[tuple[str, str], bytes] = {}


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    """Raises ShiplogError where a compiler fails."""
    write_unit(job.ship, path, record, "2")


def losses(job: Job) -> tuple[str, ...]:
    return losses_of(job, "2")


def losses_of(job: Job, version: str) -> tuple[str, ...]:
    """With the systems that it has no library for, or one that nobody has run."""
    there, lacking, nothing = [], [], []
    unit = job.ship.unit
    for system in compilers.SYSTEMS:
        folder = system.fmi2 if version == "2" else system.fmi3
        if folder and folder not in here():
            if unit is not None and unit.library(system) is None:
                nothing.append(folder)
            else:
                (lacking if compilers.for_system(system) is None else there).append(folder)
    found = list(job.ship.losses)
    if (around := given_simulator.asked(job.run)) is not None:
        found.append(given_trial.on_its_own(around, job.trial))
    if unit is not None and unit.facts["tool"]:
        found.append(f"The program that {unit.source.name} needs at run time, as it says.")
    if unit is not None and nothing:
        found.append(f"Libraries for {listed(nothing)}: {unit.source.name} has none itself.")
    if there:
        found.append(f"Libraries for {listed(there)} are compiled, and were never run.")
    if lacking:
        found.append(
            f"Libraries for {listed(lacking)}: sources alone; 'shiplog[cross]' compiles them."
        )
    if compilers.own() is None and compilers.zig() is None:
        found.append("A library for this machine: there is no C compiler.")
    return tuple(found)


def compare(job: Job, path: Path) -> Difference:
    return difference(job.trial, sail(job.ship, job.trial, path))


def write_unit(ship: Ship, path: Path, record: Sequence[str], version: str) -> None:
    """Of FMI version 2 or 3."""
    parts = _parts(ship, record, version)
    with files.whole(path) as partial, zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED) as made:
        for name, data in parts.items():
            made.writestr(zipfile.ZipInfo(name, STAMP), data, zipfile.ZIP_DEFLATED)


def _parts(ship: Ship, record: Sequence[str], version: str) -> dict[str, bytes]:
    """Name in the archive → content."""
    variables = fmu_variables.of_ship(ship)
    plain = sources(ship, version)
    token = "{" + str(uuid.uuid5(SPACE, version + "".join(plain.values()))) + "}"
    about = inert(f"{ship.ship}: {ship.label}. SI; earth axes x0, y0, body axes ahead, starboard")
    describe = fmu_description.fmi2 if version == "2" else fmu_description.fmi3
    texts = {"modelDescription.xml": describe(ship, variables, token, about)}
    code = {name: text.replace("@GUID@", token) for name, text in plain.items()}
    texts |= {f"sources/{name}": text for name, text in code.items()}
    if version == "3":
        texts["sources/buildDescription.xml"] = fmu_description.build3(ship)
    libraries = binaries(ship, code, version)
    facts = {
        "written_by": ship.author, "run": ship.run, "ship": ship.ship, "model": ship.label,
        "step_s": ship.step, "method": "Heun" if ship.heun else "Euler",
        "compared": list(record), "not_in_it": list(ship.losses),
        "binaries": {
            name: "run where this was written" if name in here() else "compiled, never run"
            for name in libraries
        },
    }  # fmt: skip
    if (unit := ship.unit) is not None:
        facts["given"] = {"name": unit.source.name, "sha256": unit.source.sha256}
    texts["resources/shiplog.json"] = json.dumps(facts, indent=2, ensure_ascii=False)
    texts["resources/OspModelDescription.xml"] = fmu_description.osp(ship, variables)
    texts["documentation/index.html"] = _page(ship, record, facts)
    found = {name: text.encode() for name, text in texts.items()}
    for name, data in libraries.items():
        ending = next(s.ending for s in compilers.SYSTEMS if name in (s.fmi2, s.fmi3))
        found[f"binaries/{name}/{ship.identifier}{ending}"] = data
    if ship.unit is not None:
        found |= {f"{given_unit.FOLDER}/{n}": data for n, data in ship.unit.content.items()}
    return found


def here() -> tuple[str, ...]:
    """FMI's words for this machine."""
    own = compilers.here()
    return (own, *(s.fmi2 for s in compilers.SYSTEMS if s.fmi3 == own and s.fmi2))


def sources(ship: Ship, version: str) -> dict[str, str]:
    """C, with @GUID@ where the token belongs. The comment at its head has no record: the code of
    a run is the same whatever it was compared with."""
    words = {"NAME": ship.identifier, "SPEED": repr(ship.speed), "GUID": "\0"}
    found = {"ship.h": c_source.header(ship, [])}
    for name in ("component.h", f"fmi{version}.c"):
        found[name] = filled(name, words, given=ship.unit is not None).replace("\0", "@GUID@")
    if ship.unit is not None:
        found["given.h"] = ship.unit.header(ship.identifier)
    return found


def binaries(ship: Ship, code: Mapping[str, str], version: str) -> dict[str, bytes]:
    """Folder in `binaries` → library, of all systems that a compiler here can write for."""
    found = {}
    for system in compilers.SYSTEMS:
        folder = system.fmi2 if version == "2" else system.fmi3
        command = compilers.for_system(system)
        if command is None or not folder:
            continue
        if ship.unit is not None and ship.unit.library(system) is None:
            continue  # what it would ask is not there
        key = (folder, "".join(code.values()))
        if key not in _compiled:
            _compiled[key] = _library(ship, code, version, command, system)
        found[folder] = _compiled[key]
    return found


def _library(
    ship: Ship, code: Mapping[str, str], version: str, command: Sequence[str],
    system: compilers.System,
) -> bytes:  # fmt: skip
    with files.temporary_folder() as folder:
        for name, text in code.items():
            (folder / name).write_text(text, encoding="utf-8")
        out = folder / "binary" / f"{ship.identifier}{system.ending}"
        opening = ["-ldl"] if ship.unit is not None and "linux" in system.fmi3 else []
        compilers.shared(command, folder / f"fmi{version}.c", out, system, opening)
        library, place = out.read_bytes(), str(folder).encode()
    if place in library:  # a debugger's note; a library goes to others
        raise ShiplogError(
            f"The library for {system.fmi3} names a folder of this machine.",
            hint="report it with the version of the compiler.",
        )
    missing = [name for name in functions(version) if name.encode() not in library]
    if missing:
        raise ShiplogError(
            f"The library for {system.fmi3} lacks {listed(missing)}.",
            hint="report it with the version of the compiler; without ziglang only this machine's "
            "library is written.",
        )
    return library


def functions(version: str) -> list[str]:
    """All that a library of FMI version 2 or 3 exports."""
    text = (
        resources.files("shiplog.export")
        .joinpath("templates", f"fmi{version}.c")
        .read_text("utf-8")
    )
    found = re.findall(rf"(?:FMI{version}|REFUSED|REFUSED_PLAIN|NONE)\((fmi{version}\w+)", text)
    for kind in re.findall(r"^NONE\((?!fmi)(\w+),", text, re.MULTILINE):
        found += [f"fmi{version}Get{kind}", f"fmi{version}Set{kind}"]
    return sorted(set(found))


def _page(ship: Ship, record: Sequence[str], facts: Mapping[str, Any]) -> str:
    rows = "".join(f"<li>{html.escape(line)}</li>" for line in (*record, *ship.losses))
    built = "".join(
        f"<li>{html.escape(name)}: {html.escape(how)}</li>"
        for name, how in facts["binaries"].items()
    )
    return (
        "<!DOCTYPE html><html lang='en'><head><meta charset='utf-8'>"
        f"<title>{html.escape(ship.run)}</title></head><body><h1>{html.escape(ship.ship)}</h1>"
        f"<p>The run {html.escape(ship.run)}, {html.escape(ship.label)}, written by "
        f"{html.escape(ship.author)}. Inner step {ship.step:g} s, {facts['method']}'s method; "
        "inputs are held over it, whatever the communication step. Earth axes x0, y0; body axes x "
        "ahead, y to starboard; heading from x0 towards y0; midship. SI.</p>"
        f"<ul>{rows}</ul><h2>Binaries</h2><ul>{built}</ul></body></html>\n"
    )


def sail(ship: Ship, trial: Trial, path: Path) -> np.ndarray:
    """[n, 6] by FMPy, a communication step an inner step. Raises NotLoaded without FMPy, or where
    no binary of this machine is in it."""
    names = Names(here(), trial.names, tuple(i.name for i in ship.inputs), ship.step)
    sailed = fmpy_sailing.sail if ship.unit is None else fmpy_sailing.sail_apart
    water = (*trial.water.wind, *trial.water.current)
    return sailed(path, names, trial.start, water, trial.orders)


def version() -> str:
    try:
        import fmpy
    except ImportError:
        return ""
    return fmpy.__version__
