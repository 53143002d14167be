"""Evidence that something changed, segment by segment: which cause, and since when.

With H_s of `segment_products`, its blocks by (e, β, γ, d), a part p has after its segments so far

    S = (I + Σ_s H_ββ)⁻¹,   H ← H - H_•β S H_β•           its own numbers β integrated out
    W = (I + Σ_p H_γγ)⁻¹,   H ← H - H_•γ W H_γ•           those of all parts, γ, likewise

of sums over s ≥ k in rows and columns of d, and over all s in the others. What is left of the
cause h that changed at k are A = H_dd and t = H_de, and its Bayes factor against no change, of
numbers d ~ N(0, I) in plausible sizes, is

    log F_hk = ½ tᵀ (I + A)⁻¹ t - ½ log|I + A|

The statistic of the watch is their mean over causes and over how long ago the change began, with a
prior that is even in the logarithm of that time (j segments ago, of at most J),

    Z_n = Σ_k π_{n-k} (1/H) Σ_h F_hk(n),   π_j = 1/((j + 1) Σ_i 1/(i + 1))

so that its expectation is no more than one at any time while nothing changes: a watch of days is no
more alarmed than one of an hour. A beginning within an earlier part is taken for that of the part;
a part that is older than MOST_PARTS is forgotten, and so is a change that began before it.

A model has errors that last for half a minute and are no change of anything: a hard manoeuvre, the
wash of a ferry. So no segment may say more than MOST_NATS by itself: it counts for

    w_s = min(1, MOST_NATS / max_h log F_h(s alone))

and what raises an alarm is several segments that say the same. What is left of a segment when all
numbers and causes are fitted to it alone, χ²_s, is watched, too (`unexplained`): then something
pushes, or measures, as no cause of the bank does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

PART = 20  # segments, as of a campaign's parts
MOST_PARTS = 48  # 8 h of a ship of three metres
MOST_NATS = 1.5  # of one segment; with 3.0 the peaks of sailing without a change are 4 nats higher


@dataclass(frozen=True)
class Evidence:
    """After a segment.

    total    log Z_n
    factors  label → greatest log F_hk over k
    began    label → segments since that k, the last one included
    """

    total: float
    factors: Mapping[str, float]
    began: Mapping[str, int]

    @property
    def suspects(self) -> list[str]:
        """Labels, the most probable first."""
        return sorted(self.factors, key=lambda label: -self.factors[label])


@dataclass
class ChangeEvidence:
    """The watch of one stretch of sailing.

    widths   numbers β, γ and d
    causes   label → places of its numbers in d
    sums     Σ_s≥k H_s of the current part, for each k in it [k, N, N]: only rows of d differ
    parts    of finished parts, β integrated out [P, N', N']
    """

    widths: tuple[int, int, int]
    causes: Mapping[str, np.ndarray]
    total: np.ndarray = field(init=False)
    since: list[np.ndarray] = field(default_factory=list)
    parts: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        size = 1 + sum(self.widths)
        self.total = np.zeros((size, size))

    def restart(self) -> None:
        """Nothing is known of a change any more; the numbers of a part begin anew."""
        self.__post_init__()
        self.since, self.parts = [], []

    def add(self, product: np.ndarray) -> Evidence:
        """One more segment of products H_s [N, N]."""
        n = self.widths[2]
        if len(self.since) == PART:
            self.parts = [*self.parts, self._without_part()][-MOST_PARTS:]
            self.total[:] = 0.0
            self.since = []
        self.total += product
        columns = product[:, -n:]
        self.since = [*(one + columns for one in self.since), columns.copy()]
        return self._evidence(*self._reduced())

    def _inverse_part(self) -> np.ndarray:
        r = self.widths[0]
        return np.linalg.inv(np.eye(r) + self.total[1 : 1 + r, 1 : 1 + r])

    def _without_part(self) -> np.ndarray:
        """H of the current part over (e, γ, d), d from its first segment on."""
        r = self.widths[0]
        rest = np.r_[0, np.arange(1 + r, len(self.total))]
        across = self.total[1 : 1 + r][:, rest]
        return self.total[np.ix_(rest, rest)] - across.T @ self._inverse_part() @ across

    def _reduced(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """t [K, n], A [K, n, n] for each beginning k, the latest first, and how many segments each
        k stands for [K]."""
        r, q, _ = self.widths
        S = self._inverse_part()
        since = np.stack(self.since[::-1])  # [K, N, n]
        of_e, of_part = self.total[1 : 1 + r, 0], since[:, 1 : 1 + r]
        solved = S @ of_part
        t = since[:, 0] - np.einsum("krn,r->kn", solved, of_e)
        cross = since[:, 1 + r : 1 + r + q] - self.total[1 + r : 1 + r + q, 1 : 1 + r] @ solved
        A = since[:, 1 + r + q :] - np.swapaxes(of_part, 1, 2) @ solved
        now = self._without_part()
        whole = now[: 1 + q, : 1 + q] + sum((p[: 1 + q, : 1 + q] for p in self.parts), 0.0)
        if self.parts:
            back = np.stack(self.parts[::-1])
            upto = now + np.cumsum(back, axis=0)
            t = np.concatenate((t, upto[:, 0, 1 + q :]))
            cross = np.concatenate((cross, upto[:, 1 : 1 + q, 1 + q :]))
            A = np.concatenate((A, upto[:, 1 + q :, 1 + q :]))
        W = np.linalg.inv(np.eye(q) + whole[1:, 1:])
        g = W @ whole[1:, 0]
        t = t - np.einsum("kqn,q->kn", cross, g)
        A = A - np.swapaxes(cross, 1, 2) @ (W @ cross)
        stands = np.concatenate((np.ones(len(since)), np.full(len(self.parts), float(PART))))
        return t, A, stands

    def _evidence(self, t: np.ndarray, A: np.ndarray, stands: np.ndarray) -> Evidence:
        each = [_factor(t[:, at], A[:, at[:, None], at]) for at in self.causes.values()]
        factors = np.stack(each)
        began = np.cumsum(stands).astype(int)
        best = factors.argmax(1)
        whole = factors + np.log(_prior_of_ages(stands)) - math.log(len(factors))
        return Evidence(
            float(np.logaddexp.reduce(whole, axis=None)),
            {label: float(factors[i, best[i]]) for i, label in enumerate(self.causes)},
            {label: int(began[best[i]]) for i, label in enumerate(self.causes)},
        )

    def alone(self, product: np.ndarray) -> float:
        """max_h log F_h of one segment by itself, of products H_s [N, N]."""
        one = ChangeEvidence(self.widths, self.causes)
        return max(one.add(product).factors.values())


def _prior_of_ages(stands: np.ndarray) -> np.ndarray:
    """π [K] of beginnings that stand for so many segments each, the latest first."""
    ends = np.cumsum(stands)
    whole = np.log(MOST_PARTS * PART) + np.euler_gamma
    return (np.log(ends + 0.5) - np.log(ends - stands + 0.5)) / whole


def _factor(t: np.ndarray, A: np.ndarray) -> np.ndarray:
    """log F = ½ tᵀ (I + A)⁻¹ t - ½ log|I + A| [K]."""
    whole = np.eye(A.shape[-1]) + A
    explained = np.einsum("kn,kn->k", t, np.linalg.solve(whole, t[..., None])[..., 0])
    return 0.5 * explained - 0.5 * np.linalg.slogdet(whole)[1]


def unexplained(product: np.ndarray, counts: float) -> float:
    """χ²_s = min_z (e - J m - z)ᵀ C⁻¹ (...) + |z|² over all numbers and causes z ~ N(0, I), of one
    segment's products H_s, at full weight."""
    H = product / counts
    across = H[1:, 0]
    return float(H[0, 0] - across @ np.linalg.solve(np.eye(len(across)) + H[1:, 1:], across))


def weight(alone: float) -> float:
    """w_s = min(1, MOST_NATS / max_h log F_h)."""
    return min(1.0, MOST_NATS / max(alone, 1e-9))
