"""What an FMU says of itself: modelDescription.xml of FMI 2.0 and 3.0, and OSP's variable groups.

Names follow FMI's structured convention: `order.rudder`, `wind.x0`. OspModelDescription.xml groups
them for connections of the Open Simulation Platform (OSP-IS 1.0).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from xml.etree import ElementTree as xml

from shiplog.export.fmu_variables import FIXED, INPUT, OUTPUT, TIME, UNITS, Variable
from shiplog.export.ship import Ship

OSP = "https://open-simulation-platform.com/OspModelDescription/1.0.0"
EXPERIMENT = {"startTime": "0", "stopTime": "600"}
CAN_2 = {
    "canHandleVariableCommunicationStepSize": "true", "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
}  # fmt: skip
CAN_3 = {
    "canHandleVariableCommunicationStepSize": "true", "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
}  # fmt: skip


def fmi2(ship: Ship, variables: Sequence[Variable], token: str, about: str) -> str:
    root = xml.Element("fmiModelDescription", {
        "fmiVersion": "2.0", "modelName": plain(ship.run), "guid": token, "description": about,
        "generationTool": ship.author, "variableNamingConvention": "structured",
    })  # fmt: skip
    kind = xml.SubElement(
        root, "CoSimulation", {"modelIdentifier": ship.identifier, **CAN_2, **_asked(ship)}
    )
    xml.SubElement(xml.SubElement(kind, "SourceFiles"), "File", {"name": "fmi2.c"})
    _units(root, variables, "BaseUnit")
    logging = xml.SubElement(root, "LogCategories")
    for name in ("logStatusWarning", "logStatusError"):
        xml.SubElement(logging, "Category", {"name": name})
    xml.SubElement(root, "DefaultExperiment", {**EXPERIMENT, "stepSize": repr(ship.step)})
    listed = xml.SubElement(root, "ModelVariables")
    booleans = 0
    for place, one in enumerate(variables):
        real = not _boolean(one)
        each = xml.SubElement(listed, "ScalarVariable", {
            "name": one.name, "valueReference": str(place if real else booleans),
            "description": one.about, **_causality(one),
            **({"initial": "calculated"} if one.role == OUTPUT else {}),
            **({"initial": "exact"} if one.role not in (INPUT, OUTPUT) else {}),
        })  # fmt: skip
        booleans += not real
        xml.SubElement(each, "Real" if real else "Boolean", _type(one))
    structure = xml.SubElement(root, "ModelStructure")
    for part in ("Outputs", "InitialUnknowns"):
        of = xml.SubElement(structure, part)
        for place, one in enumerate(variables, 1):
            if one.role == OUTPUT:
                xml.SubElement(of, "Unknown", {"index": str(place)})
    return _text(root)


def fmi3(ship: Ship, variables: Sequence[Variable], token: str, about: str) -> str:
    root = xml.Element("fmiModelDescription", {
        "fmiVersion": "3.0", "modelName": plain(ship.run), "instantiationToken": token,
        "description": about, "generationTool": ship.author,
        "variableNamingConvention": "structured",
    })  # fmt: skip
    can = CAN_3 | _asked(ship)
    xml.SubElement(root, "CoSimulation", {"modelIdentifier": ship.identifier, **can})
    _units(root, variables, "BaseUnit")
    logging = xml.SubElement(root, "LogCategories")
    for name in ("logStatusWarning", "logStatusError"):
        xml.SubElement(logging, "Category", {"name": name})
    xml.SubElement(root, "DefaultExperiment", {**EXPERIMENT, "stepSize": repr(ship.step)})
    listed = xml.SubElement(root, "ModelVariables")
    reals = sum(not _boolean(one) for one in variables)
    whole = [*variables[:reals], Variable("time", "", TIME, "s"), *variables[reals:]]
    for place, one in enumerate(whole):
        xml.SubElement(listed, "Boolean" if _boolean(one) else "Float64", {
            "name": one.name, "valueReference": str(place),
            **({"description": one.about} if one.about else {}), **_causality(one),
            **({"initial": "calculated"} if one.role == OUTPUT else {}),
            **({"initial": "exact"} if one.role not in (INPUT, OUTPUT, TIME) else {}), **_type(one),
        })  # fmt: skip
    structure = xml.SubElement(root, "ModelStructure")
    for part in ("Output", "InitialUnknown"):
        for place, one in enumerate(whole):
            if one.role == OUTPUT:
                xml.SubElement(structure, part, {"valueReference": str(place)})
    return _text(root)


def build3(ship: Ship) -> str:
    """sources/buildDescription.xml of FMI 3.0."""
    root = xml.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    how = xml.SubElement(root, "BuildConfiguration", {"modelIdentifier": ship.identifier})
    files = xml.SubElement(how, "SourceFileSet", {"language": "C99"})
    xml.SubElement(files, "SourceFile", {"name": "fmi3.c"})
    return _text(root)


def osp(ship: Ship, variables: Sequence[Variable]) -> str:
    """OspModelDescription.xml."""
    root = xml.Element("OspModelDescription", {"xmlns": OSP, "version": "1.0"})
    _units(root, variables, "BaseUnit")
    groups = xml.SubElement(root, "VariableGroups")
    position = xml.SubElement(groups, "Generic", {"name": "position_3dof"})
    _group(position, "LinearDisplacement", "position", ("x0", "y0"), "m")
    _group(position, "AngularDisplacement", "heading", ("heading",), "rad")
    velocity = xml.SubElement(groups, "Generic", {"name": "velocity_3dof"})
    _group(velocity, "LinearVelocity", "velocity", ("surge", "sway"), "m/s")
    _group(velocity, "AngularVelocity", "turning", ("yaw_rate",), "rad/s")
    for what in ("wind", "current"):
        _group(groups, "LinearVelocity", what, (f"{what}.x0", f"{what}.y0"), "m/s")
    for one in ship.inputs:
        for what in ("order", "actuator"):
            group = xml.SubElement(groups, "Generic", {"name": f"{what}_{one.name}"})
            xml.SubElement(group, "Variable", {"ref": f"{what}.{one.name}", **_unit(one.unit)})
    return _text(root)


def plain(text: str) -> str:
    """Without what XML 1.0 cannot hold, and on one line."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def _group(parent: xml.Element, kind: str, name: str, refs: Sequence[str], unit: str) -> None:
    group = xml.SubElement(parent, kind, {"name": name})
    for ref in refs:
        xml.SubElement(group, "Variable", {"ref": ref, "unit": unit})


def _units(root: xml.Element, variables: Sequence[Variable], tag: str) -> None:
    used = dict.fromkeys(one.unit for one in variables if one.unit in UNITS)
    listed = xml.SubElement(root, "UnitDefinitions")
    for name in [*used, *(() if "s" in used else ("s",))]:
        xml.SubElement(xml.SubElement(listed, "Unit", {"name": name}), tag, UNITS[name])


def _boolean(one: Variable) -> bool:
    return isinstance(one.start, bool) or one.name == "diverged"


def _causality(one: Variable) -> dict[str, str]:
    if one.role in (INPUT, OUTPUT):
        kind = "discrete" if _boolean(one) else "continuous"
        return {"causality": one.role, "variability": kind}
    if one.role == TIME:
        return {"causality": "independent", "variability": "continuous"}
    return {"causality": "parameter", "variability": "fixed" if one.role == FIXED else "tunable"}


def _asked(ship: Ship) -> dict[str, str]:
    """What an FMU that is inside asks of its importer: one instance in a process, or its tool."""
    if ship.unit is None:
        return {}
    asked = {
        "canBeInstantiatedOnlyOncePerProcess": ship.unit.facts["once"],
        "needsExecutionTool": ship.unit.facts["tool"],
    }
    return {name: "true" for name, needed in asked.items() if needed}


def _unit(unit: str) -> dict[str, str]:
    return {"unit": unit} if unit in UNITS else {}


def _type(one: Variable) -> dict[str, str]:
    if isinstance(one.start, bool):
        return {"start": str(one.start).lower()}
    found = _unit(one.unit)
    if one.start is not None:
        found["start"] = repr(float(one.start))
    if math.isfinite(one.low) and math.isfinite(one.high):
        found |= {"min": repr(one.low), "max": repr(one.high)}
    return found


def _text(root: xml.Element) -> str:
    xml.indent(root)
    return (
        xml.tostring(root, "unicode", xml_declaration=True)
        .replace(
            "<?xml version='1.0' encoding='us-ascii'?>", '<?xml version="1.0" encoding="UTF-8"?>'
        )
        .replace("<?xml version='1.0' encoding='UTF-8'?>", '<?xml version="1.0" encoding="UTF-8"?>')
    )
