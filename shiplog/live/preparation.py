"""What a watch needs of its run, worked out once and kept; in a process of its own the first time.

To fit a nominal campaign and to compile a ship's equations takes several hundred megabytes, of
which libraries and gaps between arrays stay with a process. A watch lasts for months: so a child
does it the first time, and what it keeps on disk the watch then reads.
"""

from __future__ import annotations

import gc
import logging
from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.live import calibration, nominal
from shiplog.live.calibration import Calibration
from shiplog.live.error_now import ErrorNow
from shiplog.live.nominal import Nominal
from shiplog.machine import child, memory
from shiplog.training.runs import load_model
from shiplog.training.runs.load_model import Run
from shiplog.voyages.store.store import Store

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

log = logging.getLogger(__name__)

ROWS = 100  # of a voyage at 10 Hz, of which one rollout compiles all that the error needs


def campaign_of(run: Run, path: Path, store: Store) -> tuple[Nominal, Calibration] | None:
    """The nominal campaign without its segments, and what an alarm needs of it; None where it is
    too short. `path` is the run's. Raises as `nominal`."""
    if not nominal.is_kept(run, store):
        _in_child(path, store.path)
    found = nominal.nominal(run, store)
    if found is None:
        return None
    calibrated = calibration.calibrated(found)
    kept = found.without_segments()
    del found
    gc.collect()
    memory.give_back()
    return kept, calibrated


def _in_child(path: Path, store: Path) -> None:
    """Whatever it does not manage is done again here, where it can be said."""
    process, pipe = child.spawn(_serve, {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})
    try:
        pipe.send((path, store))
        pipe.recv()
    except (EOFError, OSError):
        log.info("the nominal voyages could not be fitted in a process of their own")
    finally:
        pipe.close()
        process.join(child.PATIENCE_S)


def _serve(pipe: Connection) -> None:
    path, folder = pipe.recv()
    run, store = load_model.load(path), Store(folder)
    found = nominal.nominal(run, store)
    if found is not None:
        calibration.calibrated(found)
        (table,) = store.tables(list(found.record.names[:1]))
        rows = table.head(ROWS).collect()
        ErrorNow(run).look(rows, rows.clear())
    pipe.send(None)
