"""Trials of very many voyages on a Ray cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from shiplog.diagnosis.trial.blocks import Block, Holders
from shiplog.diagnosis.trial.cluster_blocks import OnCluster
from shiplog.diagnosis.trial.shared_trial import SharedTrial
from shiplog.diagnosis.trial.trial import Trial
from shiplog.training.network import cluster


@contextmanager
def on_cluster(address: str) -> Iterator[Callable[[Trial], Trial]]:
    """How a trial is given to the cluster, for the time of a block; that of a trial before it is
    freed. Raises ShiplogError without Ray or a cluster."""
    ray = cluster.connected(address)
    held: list[OnCluster] = []

    def hold(blocks: tuple[Block, ...]) -> Holders:
        for before in held:
            before.close()
        held[:] = [OnCluster(ray, blocks)]
        return held[0]

    try:
        yield lambda trial: SharedTrial.share(trial, hold)
    finally:
        ray.shutdown()
