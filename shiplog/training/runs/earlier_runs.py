"""Runs of an earlier program, whose equations had fewer coefficients: where their numbers go.

A coefficient that came later stands at its neutral value, which leaves its term out, and is known
without error: such a run simulates what it did when it was made.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.exceptions import RunError, listed


@dataclass(frozen=True)
class Kept:
    """Numbers as a run folder keeps them, against the order of today's parameter vector.

    at       [K]  place of each kept number in today's vector
    neutral  [P]  today's vector, with neutral values where no number was kept
    """

    at: np.ndarray
    neutral: np.ndarray

    def vector(self, values: np.ndarray, added: np.ndarray | float | None = None) -> np.ndarray:
        """[P] of kept values [K]; `added` where none was kept, instead of what is neutral."""
        whole = np.array(self.neutral if added is None else np.broadcast_to(added, self.size))
        whole[self.at] = values
        return whole

    def matrix(self, values: np.ndarray) -> np.ndarray:
        """[P, P] of a kept covariance [K, K]."""
        whole = np.zeros((self.size, self.size))
        whole[np.ix_(self.at, self.at)] = values
        return whole

    @property
    def size(self) -> int:
        return len(self.neutral)


def kept(
    physics: Sequence[str],
    count: int,
    names: Sequence[str],
    neutral_of: Callable[[str], float | None],
) -> Kept:
    """Where numbers that were kept as `physics`, `count` of them with a network's weights, go.

    physics     names of the physical coefficients when the run was made
    names       of today's parameter vector
    neutral_of  the value that leaves a coefficient's term out; None where it has none

    Raises RunError where a kept coefficient exists no more, or a new one is not neutral.
    """
    today = list(names)
    weights = [name for name in today if name.startswith("network.")]
    was = [*physics, *weights]
    gone = [name for name in was if name not in today]
    added = [name for name in today if name not in was]
    neutral = {name: neutral_of(name) for name in added}
    lacking = [name for name, value in neutral.items() if value is None]
    if gone or lacking or len(was) != count:
        which = gone or lacking or [f"{count} numbers instead of {len(was)}"]
        raise RunError(
            f"The run was made with other equations than this program's: {listed(which, most=8)}.",
            hint="train the run again.",
        )
    at = np.array([today.index(name) for name in was], dtype=int)
    return Kept(at, np.array([neutral.get(name) or 0.0 for name in today]))
