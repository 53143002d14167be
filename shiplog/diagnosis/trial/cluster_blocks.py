"""Blocks of a trial on a Ray cluster: an actor a core, each with some blocks.

An actor that is gone, or its node, costs what it had worked out and nothing else. Its blocks go to
the actors that are left, which work out the same again (`blocks`).
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from typing import Any

from shiplog.diagnosis.trial.blocks import (
    Block,
    Call,
    Kept,
    Missing,
    Sent,
    refuse_diverged,
)
from shiplog.exceptions import ShiplogError

PATIENCE_S = 2.0  # between two looks at the cluster
MOST_LOSSES = 4  # actors that one question may cost with the same block: it is then the block
ONE_THREAD = "1"  # of XLA, as of every command: the same numbers on every node


class Actor:
    """In a process of the cluster: blocks by their numbers."""

    def __init__(self) -> None:
        os.environ["NPROC"] = ONE_THREAD
        self._blocks: dict[int, Block] = {}

    def take(self, number: int, block: Block) -> None:
        self._blocks[number] = block

    def answer(self, number: int, method: str, kept: Sequence[Kept], rest: tuple[Any, ...]) -> Any:
        return self._blocks[number].answer(method, kept, rest)


class OnCluster:
    """Who holds which block; `ray` is the module, joined to a cluster."""

    def __init__(self, ray: Any, blocks: Sequence[Block]) -> None:
        self._ray = ray
        self._blocks = [ray.put(block) for block in blocks]
        self._sent = [Sent() for _ in blocks]
        self._make = ray.remote(num_cpus=1)(Actor)
        self._actors = [self._make.remote() for _ in range(max(min(self._cores(), len(blocks)), 1))]
        self._with: list[Any] = [None] * len(blocks)
        for number in range(len(blocks)):
            self._give(number, self._actors[number % len(self._actors)])

    def answer(self, call: Call) -> list[Any]:
        """As `Holders.answer`. Raises ShiplogError where no core of the cluster is left, or a
        block ends whoever holds it."""
        answers: dict[int, Any] = dict.fromkeys(call.kept)
        waiting = {
            self._ask(number, call, self._sent[number].first(kept)): number
            for number, kept in call.kept.items()
        }
        losses: Counter[int] = Counter()
        while waiting:
            done, _ = self._ray.wait(list(waiting), timeout=PATIENCE_S)
            for reference in done:
                number = waiting.pop(reference)
                try:
                    said = self._ray.get(reference)
                except self._ray.exceptions.RayActorError as error:
                    losses[number] += 1
                    if losses[number] > MOST_LOSSES:
                        raise _too_large(losses[number], error) from error
                    self._replace(self._with[number], number)
                    said = Missing()
                if isinstance(said, Missing):
                    waiting[self._ask(number, call, call.kept[number])] = number
                else:
                    answers[number] = said
        return refuse_diverged(list(answers.values()))

    def close(self) -> None:
        """The actors end, with all that they hold."""
        for actor in self._actors:
            self._ray.kill(actor)
        self._actors, self._blocks = [], []

    def _ask(self, number: int, call: Call, kept: Sequence[Kept]) -> Any:
        return self._with[number].answer.remote(number, call.method, list(kept), call.rest)

    def _give(self, number: int, actor: Any) -> None:
        actor.take.remote(number, self._blocks[number])
        self._with[number] = actor

    def _replace(self, gone: Any, number: int) -> None:
        """Give the block to an actor that is left, in turn; to a new one where none is."""
        self._actors = [actor for actor in self._actors if actor is not gone]
        if not self._actors:
            if self._cores() < 1:
                raise ShiplogError(
                    "No core of the Ray cluster is left, and the diagnosis needs one.",
                    hint="start nodes with `ray start --address ADDRESS`, and give the command "
                    "again.",
                )
            self._actors = [self._make.remote()]
        self._give(number, self._actors[number % len(self._actors)])

    def _cores(self) -> int:
        return int(self._ray.cluster_resources().get("CPU", 0))


def _too_large(losses: int, error: Exception) -> ShiplogError:
    words = " ".join(str(error).split())[:200]
    return ShiplogError(
        f"{losses} processes of the Ray cluster ended while they held the same voyages: {words}",
        hint="if that is want of memory, start nodes with more of it, or fewer cores to a node.",
    )
