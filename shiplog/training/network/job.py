"""One training: all that a process needs for it, on this machine or on another."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from shiplog.exceptions import RunError
from shiplog.models.feedforward import FeedForward, Scaling
from shiplog.models.network_shape import Shape
from shiplog.training.network import network_training
from shiplog.training.network.network_gradient import Batch
from shiplog.training.network.network_training import Checkpoint, Progress
from shiplog.training.settings.run_config import Config


@dataclass(frozen=True)
class Training:
    """One seed of a run: settings, the network's first weights, and windows.

    Holds arrays and no paths, so that it can be sent to another machine.
    """

    config: Config
    seed: int
    model: FeedForward
    training: Batch
    validation: Batch

    @property
    def shape(self) -> Shape:
        return self.model.shape

    @property
    def scaling(self) -> Scaling:
        return self.model.scaling

    def run(
        self,
        resume: Progress | None = None,
        checkpoint: Checkpoint | None = None,
        pause: int | None = None,
        report: Callable[[float], None] | None = None,
    ) -> Progress:
        """Train by the configuration's recipe.

        resume      where an earlier call stood (the paper's recipe; the fast one begins anew)
        checkpoint  is called now and then with where it stands (the paper's recipe)
        pause       return after so many epochs, finished or not (the paper's recipe)
        report      is called with the share that is done

        Raises RunError where windows hold what is not a number, or no weights have a finite loss.
        """
        self.refuse_not_finite()
        batches = (self.training, self.validation)
        if self.config.recipe == "paper":
            progress = network_training.paper(
                self.model, *batches, self.config.paper, self.seed, checkpoint=checkpoint,
                resume=resume, pause=pause, report=report,
            )  # fmt: skip
        else:
            progress = network_training.fast(
                self.model, *batches, self.config.fast, self.seed, report=report
            )
        self.refuse_diverged(progress)
        return progress

    def refuse_diverged(self, progress: Progress) -> None:
        """Raises RunError where no weights of a training have a finite loss."""
        if not math.isfinite(progress.best):
            raise RunError(
                f"Every rollout of seed {self.seed} diverged: no weights have a finite loss.",
                hint="check the units and signs of velocities and actuators in the profile; "
                "`shiplog voyages --sensors` compares the sensors with each other.",
            )

    def refuse_not_finite(self) -> None:
        """Raises RunError where windows hold what is not a number."""
        batches = (self.training, self.validation)
        for name, batch in zip(("training", "validation"), batches, strict=True):
            if not all(bool(t.isfinite().all()) for t in (batch.velocity, batch.driven, batch.dt)):
                raise RunError(
                    f"The {name} windows hold values that are not finite.",
                    hint="ingest the voyages again and see `shiplog check` for what is wrong.",
                )

    def finished(self, progress: Progress) -> bool:
        """Whether its recipe is at an end there."""
        if self.config.recipe == "fast":
            return True
        return network_training.paper_done(progress, self.config.paper)
