"""Learn a ship's dynamic model from its logs, and see where it fails.

    import shiplog

    store = shiplog.ingest("sample_logs", "tour/store").store
    run = shiplog.train(store, "tour/runs/mmg", model="mmg", voyages=["voyage_1", "voyage_2"])
    print(shiplog.evaluate(run, store, "voyage_6"))
    print(shiplog.diagnose(run, store, "season2_*", out="tour/diagnosis"))

The commands are functions; `load` and `open_store` open what they left. What is heavy is imported
at the first call.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from shiplog.commands.api import (
        check,
        compare,
        convert,
        diagnose,
        diagnose_list,
        evaluate,
        export_run,
        find_manoeuvres,
        gate,
        ingest,
        load,
        open_store,
        plan,
        profile,
        sensors,
        simulate,
        train,
        trend,
    )
    from shiplog.commands.compare import Comparison
    from shiplog.commands.convert import Converted, Draft
    from shiplog.commands.gate import Gate
    from shiplog.commands.prepare import Ingested
    from shiplog.commands.sensors import SensorComparison
    from shiplog.exceptions import ShiplogError
    from shiplog.export.exported import Exported
    from shiplog.report.diagnosis.diagnosis import Diagnosis
    from shiplog.report.evaluation.evaluation import Evaluation
    from shiplog.report.fleet.fleet import Fleet
    from shiplog.report.manoeuvres.sheet import ManoeuvreSheet
    from shiplog.report.planning import Planned
    from shiplog.report.season.season import Season
    from shiplog.report.simulation import Simulation
    from shiplog.training.runs.load_model import Run
    from shiplog.voyages.store.store import Store
    from shiplog.voyages.store.voyage import Voyage

    __version__: str

__all__ = [
    "Comparison",
    "Converted",
    "Diagnosis",
    "Draft",
    "Evaluation",
    "Exported",
    "Fleet",
    "Gate",
    "Ingested",
    "ManoeuvreSheet",
    "Planned",
    "Run",
    "Season",
    "SensorComparison",
    "ShiplogError",
    "Simulation",
    "Store",
    "Voyage",
    "__version__",
    "check",
    "compare",
    "convert",
    "diagnose",
    "diagnose_list",
    "evaluate",
    "export_run",
    "find_manoeuvres",
    "gate",
    "ingest",
    "load",
    "open_store",
    "plan",
    "profile",
    "sensors",
    "simulate",
    "train",
    "trend",
]

# Where a class is defined; functions are in `commands/api.py`.
_CLASSES = {
    "Comparison": "commands.compare",
    "Converted": "commands.convert",
    "Diagnosis": "report.diagnosis.diagnosis",
    "Draft": "commands.convert",
    "Evaluation": "report.evaluation.evaluation",
    "Exported": "export.exported",
    "Fleet": "report.fleet.fleet",
    "Gate": "commands.gate",
    "Ingested": "commands.prepare",
    "ManoeuvreSheet": "report.manoeuvres.sheet",
    "Planned": "report.planning",
    "Run": "training.runs.load_model",
    "Season": "report.season.season",
    "SensorComparison": "commands.sensors",
    "ShiplogError": "exceptions",
    "Simulation": "report.simulation",
    "Store": "voyages.store.store",
    "Voyage": "voyages.store.voyage",
}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name == "__version__":
        from importlib.metadata import version

        return version("shiplog")
    from importlib import import_module

    return getattr(import_module(f"shiplog.{_CLASSES.get(name, 'commands.api')}"), name)


def __dir__() -> list[str]:
    return [*globals(), *__all__]
