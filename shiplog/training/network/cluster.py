"""The same trainings on a Ray cluster (extra `ray`), a core each.

The paper's recipe goes there in pieces, and what a piece came to is brought back: a node that dies
costs a piece, which another node does again to the same bits.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from shiplog.exceptions import ShiplogError
from shiplog.training.network.job import Training
from shiplog.training.network.network_training import Progress

PIECE_EPOCHS = 500  # epochs of the paper's recipe that are done at a time
PATIENCE_S = 2.0  # between two looks at the cluster


@dataclass(frozen=True)
class Result:
    """Where a training stands: after a piece of it, or at its end, or why there is none."""

    name: str
    progress: Progress | None
    ended: bool
    failure: str = ""


def _piece(training: Training, resume: Progress | None) -> Progress:
    import torch

    torch.set_num_threads(1)
    return training.run(resume, pause=PIECE_EPOCHS)


def work(
    trainings: Mapping[str, tuple[Training, Progress | None]], address: str
) -> Generator[Result, None, None]:
    """Do all trainings, each from where it stands. Raises ShiplogError without Ray or a cluster.

    address   of the cluster's head, as `ray start` prints it
    """
    ray = connected(address)
    # A node that is gone is no fault of the training: it is done again until it ends.
    piece = ray.remote(num_cpus=1, max_retries=-1)(_piece)
    try:
        held = {name: ray.put(training) for name, (training, _) in trainings.items()}
        running: dict[Any, str] = {}
        for name, (_, resume) in trainings.items():
            running[piece.remote(held[name], resume)] = name
        while running:
            done, _ = ray.wait(list(running), timeout=PATIENCE_S)
            for reference in done:
                name = running.pop(reference)
                try:
                    progress = ray.get(reference)
                except Exception as error:  # of the training, as Ray wraps it
                    cause = getattr(error, "cause", None) or error
                    yield Result(name, None, True, str(cause))
                    continue
                ended = trainings[name][0].finished(progress)
                if not ended:
                    running[piece.remote(held[name], progress)] = name
                yield Result(name, progress, ended)
    finally:
        ray.shutdown()


def connected(address: str) -> Any:
    """Ray, joined to the cluster."""
    if find_spec("ray") is None:
        raise ShiplogError(
            "--ray needs Ray, which is not installed.",
            hint="in the clone of shiplog: pip install '.[ray]'.",
        )
    ray: Any = import_module("ray")
    try:
        ray.init(address=address, log_to_driver=False, logging_level="ERROR")
    except Exception as error:  # ConnectionError, RuntimeError, ValueError, as the case may be
        words = " ".join(str(error).split())[:200]
        raise ShiplogError(
            f"There is no Ray cluster at {address}: {words}.",
            hint="start one with `ray start --head`, and give the address that it prints.",
        ) from error
    return ray
