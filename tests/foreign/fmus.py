"""FMUs that tests build from C, with names and units of their own."""

import platform
import shutil
import subprocess
import sys
import tempfile
import uuid
import zipfile
from functools import cache
from pathlib import Path

import pytest

FOLDER = tempfile.TemporaryDirectory(prefix="shiplog-fmus-")
SOURCE = Path(__file__).parent / "tanker.c"
OUTPUTS = [("x", "m"), ("u", "kn"), ("y", "m"), ("v", "m/s"), ("psi", "rad"), ("r", "rad/s")]
INPUTS = [("rudder_port", "deg"), ("rudder_starboard", "deg"), ("propeller", "rpm"),
          ("wind_north", "m/s"), ("wind_east", "m/s")]  # fmt: skip
UNITS = sorted({unit for _, unit in OUTPUTS + INPUTS})


def build(to, version=2, outputs=OUTPUTS, inputs=INPUTS, time=False, exchange=False, **wrong):
    """An FMU of the tanker; `wrong` is what is compiled into it, such as REFUSE=30. Skipped where
    there is no compiler."""
    library = compiled(tuple(f"-D{name}={value}" for name, value in wrong.items()))
    machine = platform.machine()
    place = "linux64" if version == 2 else f"{machine}-linux"
    with zipfile.ZipFile(to, "w") as zipped:
        describe = description2 if version == 2 else description3
        text = describe(outputs, inputs, time)
        zipped.writestr("modelDescription.xml", exchanged(text) if exchange else text)
        zipped.write(library, f"binaries/{place}/tanker.so")
    return to


@cache
def compiled(flags):
    """The library, built once for each choice of flags."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None or sys.platform != "linux":
        pytest.skip("an FMU is built from C, and there is no gcc")
    library = Path(FOLDER.name) / f"{len(list(Path(FOLDER.name).iterdir()))}.so"
    subprocess.run(
        [compiler, "-O1", "-w", "-shared", "-fPIC", *flags, "-o", library, SOURCE, "-lm"],
        check=True,
    )
    return library


def variables(outputs, inputs, time):
    """(name, reference, causality, variability, initial, start, unit)"""
    found = [(n, i, "output", "continuous", "", "", u) for i, (n, u) in enumerate(outputs)]
    found += [
        (f"{n}_start", 10 + i, "parameter", "fixed", "exact", "0", u)
        for i, (n, u) in enumerate(outputs)
    ]
    known = {name: i for i, (name, _) in enumerate(INPUTS)}
    found += [(n, 20 + known[n], "input", "continuous", "", "0", u) for n, u in inputs]
    return [*found, ("time", 30, "output", "continuous", "", "", "")] if time else found


def description2(outputs, inputs, time):
    rows = []
    for name, reference, causality, variability, initial, start, unit in variables(
        outputs, inputs, time
    ):
        first = f' initial="{initial}"' if initial else ""
        of = f' start="{start}"' if start else ""
        of += f' unit="{unit}"' if unit else ""
        rows.append(
            f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}" '
            f'variability="{variability}"{first}><Real{of}/></ScalarVariable>'
        )
    units = "".join(f'<Unit name="{unit}"/>' for unit in UNITS)
    count = len(outputs) + time
    listed = [*range(1, len(outputs) + 1), *([len(rows)] if time else [])]
    structure = "".join(f'<Unknown index="{i}"/>' for i in listed[:count])
    return (
        f'<fmiModelDescription fmiVersion="2.0" modelName="tanker" guid="{{{uuid.UUID(int=1)}}}">'
        f'<CoSimulation modelIdentifier="tanker" canHandleVariableCommunicationStepSize="true"/>'
        f"<UnitDefinitions>{units}</UnitDefinitions>"
        f'<DefaultExperiment stepSize="0.1"/><ModelVariables>{"".join(rows)}</ModelVariables>'
        f"<ModelStructure><Outputs>{structure}</Outputs></ModelStructure></fmiModelDescription>"
    )


def exchanged(text):
    """The description of FMI 2.0 for model exchange: outputs are states, with derivatives."""
    count = text.count("<ScalarVariable ")
    more = "".join(
        f'<ScalarVariable name="der({name})" valueReference="{40 + i}" causality="local" '
        f'variability="continuous"><Real derivative="{i + 1}"/></ScalarVariable>'
        for i, (name, _) in enumerate(OUTPUTS)
    )
    of = "".join(f'<Unknown index="{count + 1 + i}"/>' for i in range(len(OUTPUTS)))
    return (
        text.replace("<CoSimulation", "<ModelExchange")
        .replace('canHandleVariableCommunicationStepSize="true"',
                 'providesDirectionalDerivative="true"')
        .replace("</ModelVariables>", f"{more}</ModelVariables>")
        .replace("</ModelStructure>", f"<Derivatives>{of}</Derivatives></ModelStructure>")
    )  # fmt: skip


def description3(outputs, inputs, time):
    rows = []
    for name, reference, causality, variability, initial, start, unit in variables(
        outputs, inputs, time
    ):
        of = f' initial="{initial}"' if initial else ""
        of += f' start="{start}"' if start else ""
        of += f' unit="{unit}"' if unit else ""
        rows.append(
            f'<Float64 name="{name}" valueReference="{reference}" causality="{causality}" '
            f'variability="{variability}"{of}/>'
        )
    units = "".join(f'<Unit name="{unit}"/>' for unit in UNITS)
    structure = "".join(f'<Output valueReference="{i}"/>' for i in range(len(outputs)))
    return (
        '<fmiModelDescription fmiVersion="3.0" modelName="tanker" instantiationToken="1">'
        '<CoSimulation modelIdentifier="tanker" canHandleVariableCommunicationStepSize="true"/>'
        f"<UnitDefinitions>{units}</UnitDefinitions>"
        f'<DefaultExperiment stepSize="0.1"/><ModelVariables>{"".join(rows)}</ModelVariables>'
        f"<ModelStructure>{structure}</ModelStructure></fmiModelDescription>"
    )
