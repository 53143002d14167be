"""Whether held-out voyages and days bear an identification out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import polars as pl

from shiplog.exceptions import RunError
from shiplog.models import MODELS
from shiplog.simulation.sensitivities import losses
from shiplog.training.physics.cross_validation import CrossValidated
from shiplog.training.physics.output_error import Identified
from shiplog.training.physics.setup import Prepared
from shiplog.training.settings.run_config import Config


def refuse_nothing_held_out(config: Config, ready: Prepared, held: pl.DataFrame) -> None:
    """Raises RunError for a hybrid that has no voyage to be tested on.

    held   seconds of the validation voyages
    """
    able = len(set(ready.voyages)) > 1 and config.physics.folds > 1
    if MODELS[config.model].residual and not able and not held.height:
        raise RunError(
            "A hybrid needs a voyage to hold out: its network is not trusted otherwise.",
            hint="name a second voyage with --voyages and leave --folds out, or name one with "
            "--validation.",
        )


class HeldOutErrors(NamedTuple):
    """Windows rolled out by fits that did not know their voyage, or their day.

    before    [N] L of the starting values
    by_day    None where a day is a voyage; both None where nothing can be held out
    """

    before: np.ndarray
    by_voyage: CrossValidated | None
    by_day: CrossValidated | None

    @property
    def parts(self) -> list[tuple[str, CrossValidated]]:
        both = (("voyages", self.by_voyage), ("days", self.by_day))
        return [(name, one) for name, one in both if one is not None]

    def sentences(self, ready: Prepared, found: Identified, folds: int) -> list[str]:
        """The gain on the training windows and on held-out ones."""
        after = losses(ready.model, found.values, ready.data)
        notes = [_sentence("training windows", self.before, after)]
        notes += [
            _sentence(f"windows of held-out {name}", self.before, one.loss)
            for name, one in self.parts
        ]
        return [*notes, untested] if (untested := self._untested(folds)) else notes

    def _untested(self, folds: int) -> str:
        if self.by_voyage is not None:
            return ""
        why = "One voyage only" if folds > 1 else "--folds is below two"
        return f"{why}: nothing was held out, so the gain is not tested."

    def line(self, ready: Prepared, found: Identified, folds: int) -> str:
        """Mean L before the fit, after it and on what is held out; the windows that diverge are
        counted, and are in no mean."""
        after = losses(ready.model, found.values, ready.data)
        means = [("before the fit", self.before), ("fitted", after)]
        means += [(f"on held-out {name}", one.loss) for name, one in self.parts]
        each = ", ".join(f"{_mean(loss)} {when}" for when, loss in means)
        return f"Mean L: {each}. {self._untested(folds)}".rstrip()

    def table(self) -> pl.DataFrame:
        """A row a window: held_out (voyages or days), group, window, start, loss."""
        return pl.concat(
            pl.DataFrame(
                {
                    "held_out": [name] * len(self.before),
                    "group": one.groups,
                    "window": np.arange(len(self.before)),
                    "start": self.before,
                    "loss": one.loss,
                }
            )
            for name, one in self.parts
        )


def unfitted_sentence(loss: np.ndarray) -> str:
    """Of starting values that stay as they are: L of every window [N]."""
    return f"Mean L {loss.mean():.0f} over the {len(loss)} windows named, with nothing fitted."


def _mean(loss: np.ndarray) -> str:
    ends = np.isfinite(loss)
    lost = f" ({int((~ends).sum())} of {len(loss)} windows diverged)" if not ends.all() else ""
    return f"{loss[ends].mean():.0f}{lost}" if ends.any() else f"none{lost}"


def _sentence(where: str, before: np.ndarray, after: np.ndarray) -> str:
    """Of the windows that end with both: one that diverges says nothing of the others."""
    ends = np.isfinite(before) & np.isfinite(after)
    lost = [
        f"{int((~np.isfinite(loss)).sum())} diverge {when}"
        for when, loss in (("at the start", before), ("identified", after))
        if not np.isfinite(loss).all()
    ]
    if not ends.any():
        return f"Of {len(before)} {where}, {' and '.join(lost)}."
    first, then = before[ends].mean(), after[ends].mean()
    text = (
        f"Mean L over {int(ends.sum())} {where}: {first:.0f} at the start, "
        f"{then:.0f} identified ({then / first:.3f})."
    )
    return f"{text} Of {len(before)}, {' and '.join(lost)}." if lost else text
