"""Products of a finished segment, in the few directions in which a ship's numbers show.

With x the numbers of the model (coefficients, causes' nominal numbers, weights of its discrepancy)
a segment of part p of the watch has, as a segment of a campaign (`diagnosis.nominal`),

    e_s = J_s (m + c + b_p) + J_s d_h 1(s ≥ k) + noise,   b_p ~ N(0, D),  c ~ N(0, V + a² D)

with m and V of the nominal campaign and d_h a change of one cause's numbers from segment k on. Of b
and c only what the segments can feel is kept: with the mean products M̄ of a part,

    B = P^½ U_r,   P^½ M̄ P^½ = U Λ Uᵀ, eigenvalues above LEAST_FELT,   P = D or V + a² D

so that b ≈ B_b β, c ≈ B_c γ, β and γ ~ N(0, I), and a segment is the small matrix of products

    H_s = Tᵀ G_s T,   T maps (1, β, γ, d) to (1, -(m + B_b β + B_c γ), -d)

whose first row and column belong to e_s - J_s m. All in units of `Columns.unit`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from shiplog.diagnosis.linear import linearisation
from shiplog.diagnosis.linear.measurement_correction import read
from shiplog.diagnosis.linear.segments import SegmentGrid
from shiplog.diagnosis.noise import part_products
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.nominal.nominal_campaign import Campaign
from shiplog.diagnosis.nominal.nominal_reference import Reference
from shiplog.live.nominal import bank_columns
from shiplog.voyages.rows.recording import Record

LEAST_FELT = 0.05  # a direction whose products with a part are fewer standard deviations squared
MOST_FELT = 48  # directions of b, and of c, at most
AT_ONCE = 8  # segments that are linearised together: one kernel call for all lanes


@dataclass(frozen=True)
class Directions:
    """T of the above.

    mean     [C]       m
    of_part  [C, r]    B_b
    of_all   [C, q]    B_c
    causes   label → columns [n] of a cause among the numbers
    counts   share of itself that a segment counts (`campaign_prior`)
    """

    mean: np.ndarray
    of_part: np.ndarray
    of_all: np.ndarray
    causes: Mapping[str, np.ndarray]
    counts: float

    @property
    def widths(self) -> tuple[int, int, int]:
        """Numbers β of a part, γ of all parts, and d of all causes."""
        return (
            self.of_part.shape[1], self.of_all.shape[1],
            sum(len(columns) for columns in self.causes.values()),
        )  # fmt: skip

    def products(self, gram: np.ndarray) -> np.ndarray:
        """H_s [1 + r + q + n, ...] of G_s [1 + C, 1 + C]."""
        count = len(self.mean)
        columns = np.concatenate([*self.causes.values(), np.zeros(0, int)]).astype(int)
        T = np.zeros((1 + count, 1 + sum(self.widths)))
        T[0, 0] = 1.0
        T[1:, 0] = -self.mean
        r, q, n = self.widths
        T[1:, 1 : 1 + r] = self.of_part
        T[1:, 1 + r : 1 + r + q] = self.of_all
        T[1 + columns, 1 + r + q + np.arange(n)] = 1.0
        return self.counts * (T.T @ (gram @ T))


def directions(campaign: Campaign, left_out: int = -1) -> Directions:
    """T of a campaign, one voyage of it left out unless -1. Raises np.linalg.LinAlgError."""
    information, pull = campaign.prior_without(left_out, campaign.apart)
    P_all = np.linalg.inv(information)
    parts, count = campaign.each, len(pull)
    M = campaign.reference.counts * np.mean(
        [one[1 : 1 + count, 1 : 1 + count] for one in parts], axis=0
    )
    D_half = np.diag(campaign.effects.deviation)
    values, vectors = np.linalg.eigh(P_all)
    P_half = vectors * np.sqrt(np.maximum(values, 0.0))
    return Directions(
        P_all @ pull, _felt(D_half, M), _felt(P_half, M), bank_columns(campaign),
        campaign.reference.counts,
    )  # fmt: skip


def _felt(root: np.ndarray, M: np.ndarray) -> np.ndarray:
    """P^½ U_r [C, r], of P^½ = `root` [C, C] with P = root rootᵀ."""
    values, vectors = np.linalg.eigh(root.T @ M @ root)
    kept = np.flatnonzero(values > LEAST_FELT)[-MOST_FELT:]
    return root @ vectors[:, kept]


def grams(ref: Reference, grid: SegmentGrid, record: Record, rows: np.ndarray) -> list[np.ndarray]:
    """G_s [1 + C, 1 + C] of the segments that begin at these rows of a record, each linearised
    about its own path. One on which the model diverges has zeros."""
    found: list[np.ndarray] = []
    whole = np.concatenate((ref.theta, ref.columns.numbers({})))
    prior = ref.process_noise.inverse_kernels(grid.nodes)
    acting = None if ref.misfit is None else partial(ref.misfit.accelerations, g=grid)
    wide = ref.allowed_distance(1.0, Remainder())
    for at in range(0, len(rows), AT_ONCE):
        some = rows[at : at + AT_ONCE]
        cut, moved, observed = read(ref.model, ref.setting, record, some, {})
        about = ref.expected_acceleration(cut, grid)
        path = linearisation.fit_path(ref.model, whole, cut, grid, wide, about=about)
        linear = linearisation.linear(ref.model, whole, cut, grid, path, moved, observed, ref.wide)
        each = [np.array([i]) for i in range(len(some))]
        for one, lost in zip(part_products.passes(
            linear, ref.process_noise, each, ref.columns.unit, None, acting
        ), linear.lost, strict=True):  # fmt: skip
            gram = one.gram(prior).G
            found.append(np.zeros_like(gram) if lost else gram)
    return found
