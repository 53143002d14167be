"""In the child: what an FMU says of itself, by FMPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from shiplog.foreign.callables import Refused


def description(path: Path) -> dict[str, Any]:
    """What the model description says. Raises Refused."""
    fmpy = library()
    try:
        found = fmpy.read_model_description(str(path), validate=False)
    except Exception as error:
        raise Refused(f"its model description cannot be read: {first_line(error)}") from error
    exchange = found.modelExchange is not None and found.fmiVersion.startswith("2.")
    if found.coSimulation is None and not exchange:
        raise Refused(
            "it is neither for co-simulation (FMI 2.0 or 3.0) nor for model exchange (FMI 2.0)"
        )
    if not found.fmiVersion.startswith(("2.", "3.")):
        raise Refused(f"it is of FMI {found.fmiVersion}; export it as FMI 2.0 or 3.0")
    variables = []
    for one in found.modelVariables:
        kind = {"Real": "real", "Float64": "real", "Boolean": "boolean", "Integer": "integer",
                "Int32": "integer"}.get(str(one.type))  # fmt: skip
        if kind is None or one.dimensions:
            continue
        declared = getattr(one, "declaredType", None)
        unit = one.unit or (getattr(declared, "unit", None) if declared is not None else None)
        variables.append({
            "name": one.name, "causality": one.causality or "local", "kind": kind,
            "settable": one.start is not None and one.variability != "constant"
            and one.causality not in ("calculatedParameter", "independent"),
            "unit": unit or "", "description": one.description or "",
        })  # fmt: skip
    fixed = getattr(found.coSimulation, "fixedInternalStepSize", None)
    experiment = found.defaultExperiment
    step = fixed or (experiment.stepSize if experiment is not None else None) or 0.0
    return {
        "name": path.name, "version": found.fmiVersion, "tool": found.generationTool or "",
        "step": min(float(step), 1.0), "variables": variables,
        "exchange": found.coSimulation is None, "unit": _unit(found),
    }  # fmt: skip


def _unit(found: Any) -> dict[str, Any]:
    """What C needs in order to call it: `export.given_unit` puts it into another FMU."""
    kind = found.coSimulation or found.modelExchange
    states = [] if found.coSimulation is not None else [d.variable for d in found.derivatives]
    return {
        "token": found.guid, "identifier": kind.modelIdentifier,
        "once": bool(kind.canBeInstantiatedOnlyOncePerProcess),
        "tool": bool(kind.needsExecutionTool),
        "inner": float(getattr(kind, "fixedInternalStepSize", None) or 0.0),
        "references": {v.name: v.valueReference for v in found.modelVariables},
        "whole": [v.name for v in found.modelVariables if str(v.type) in ("Integer", "Int32")],
        "states": [one.derivative.name for one in states],
    }  # fmt: skip


def library() -> Any:
    """FMPy. Raises Refused without it."""
    try:
        import fmpy
    except ImportError as error:
        raise Refused("FMPy runs FMUs, and is not installed; pip install 'shiplog[fmu]'") from error
    return fmpy


def first_line(error: BaseException) -> str:
    """Of what an exception says."""
    lines = str(error).strip().splitlines()
    return lines[0][:200] if lines else type(error).__name__
