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
        Comparison,
        Diagnosis,
        Evaluation,
        Ingested,
        compare,
        diagnose,
        evaluate,
        ingest,
        load,
        open_store,
        train,
    )

__all__ = [
    "Comparison",
    "Diagnosis",
    "Evaluation",
    "Ingested",
    "compare",
    "diagnose",
    "evaluate",
    "ingest",
    "load",
    "open_store",
    "train",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from shiplog.commands import api

    return getattr(api, name)


def __dir__() -> list[str]:
    return [*globals(), *__all__]
