"""Whether what a model leaves over is noise: whiteness of its residuals, and whether the inputs
still explain any of them, as tests with a stated level (Ljung 1999, sec. 16.6).

The residual is of one second: ν of the next second less what the model makes of this one.

    e_t = ν_{t+1} - ν̂(x_t, u_t),   a_t = e_t - b a_{t-1}

Noise of the velocity sensor enters two residuals in turn with opposite signs, which is no fault of
the model: b ≤ 0 of the moving average that it makes is estimated and taken out (Box & Jenkins
1970).
Of the innovations a [n], with autocorrelations ρ_k within unbroken stretches:

    whiteness     Q = n (n + 2) Σ_{k=1}^m ρ_k²/(n - k) ~ χ²(m - 1)          (Ljung & Box 1978)
    input x       T = n cᵀ P⁺ c ~ χ²(rank P),   c_k = corr(a_t, x_{t-k})
                  P_jk = Σ_τ ρ_a(τ) ρ_x(τ + j - k)            (Söderström & Stoica 1989, sec. 11.2)

All tests of a model share LEVEL after Holm (1979): of models whose residuals are noise, one in
twenty gets any word against it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import chdtrc

from shiplog.nomenclature.channels import VELOCITY

LEVEL = 0.05  # of all tests of one model together
LAGS = 20  # s of the test of whiteness
INPUT_LAGS = (0, 1, 2, 4, 8, 16)  # s by which an input precedes the residual
MEMORY = 60  # s over which autocorrelations are summed, tapered to zero there (Bartlett 1946)
MOST_ROWS = 40_000  # s, the first of them: eleven hours say it as surely, in bounded memory
LEAST_ROWS = 200  # s: of fewer, a test of twenty lags says nothing
MOST_NOISE = -0.99  # b: a sensor so noisy that its white noise is all that is seen
SINGULAR = 1e-2  # of the largest eigenvalue of P: an input that hardly moves has fewer directions


@dataclass(frozen=True, slots=True)
class ResidualTest:
    """One test of one channel's residuals.

    against       "whiteness", or the input's name
    statistic     Q or T, with `freedom` degrees of freedom under the hypothesis
    p             its probability there, adjusted by Holm's rule
    correlation   the largest, and the lag [s] of it
    """

    channel: str
    against: str
    samples: int
    statistic: float
    freedom: int
    p: float
    correlation: float
    lag_s: float

    @property
    def rejected(self) -> bool:
        return self.p < LEVEL

    def as_json(self) -> dict:
        return asdict(self) | {"rejected": self.rejected, "level": LEVEL}


def residual_tests(
    errors: np.ndarray, stretches: np.ndarray, inputs: Mapping[str, np.ndarray]
) -> tuple[ResidualTest, ...]:
    """Whiteness of every channel, and each input against it.

    errors      [n, 3]  e of surge, sway and yaw rate, second by second
    stretches   [n]     which unbroken stretch a second is of
    inputs      name → x [n] at the beginning of each second

    Nothing where there are fewer than LEAST_ROWS seconds, or where the model diverged.
    """
    if len(errors) < LEAST_ROWS or not np.isfinite(errors).all():
        return ()
    apart = np.flatnonzero(np.diff(stretches)) + 1
    found = []
    for j, channel in enumerate(VELOCITY):
        parts = np.split(errors[:, j] - errors[:, j].mean(), apart)
        a = _innovations(parts)
        if not np.concatenate(a).any():
            continue
        found.append(_whiteness(channel.name, a))
        for name, values in inputs.items():
            if values.std() > 0.0:
                x = np.split(values - values.mean(), apart)
                found.append(_input(channel.name, name, a, x))
    return _holm(found)


def _innovations(parts: Sequence[np.ndarray]) -> list[np.ndarray]:
    """a_t = e_t - b a_{t-1} in each stretch, b of the least Σ a²."""
    from scipy.signal import lfilter  # 0.7 s to load

    def whitened(b: float) -> list[np.ndarray]:
        return [np.asarray(lfilter([1.0], [1.0, b], part)) for part in parts]

    def squares(b: float) -> float:
        return float(sum(a @ a for a in whitened(b)))

    best: Any = minimize_scalar(squares, bounds=(MOST_NOISE, 0.0), method="bounded")
    return whitened(float(best.x))


def _correlations(
    a: Sequence[np.ndarray], x: Sequence[np.ndarray], lags: Sequence[int]
) -> np.ndarray:
    """Σ_t a_t x_{t-k}/(Σ a² Σ x²)^½ for each lag k ≥ 0, within stretches."""
    size = np.sqrt(sum(p @ p for p in a) * sum(p @ p for p in x))
    sums = [
        sum(p[k:] @ q[: len(q) - k] for p, q in zip(a, x, strict=True) if len(p) > k) for k in lags
    ]
    return np.array(sums) / size


def _whiteness(channel: str, a: Sequence[np.ndarray]) -> ResidualTest:
    n = sum(map(len, a))
    k = np.arange(1, LAGS + 1)
    rho = _correlations(a, a, k.tolist())
    Q = n * (n + 2) * float((rho**2 / (n - k)).sum())
    worst = int(np.argmax(np.abs(rho)))
    p = float(chdtrc(LAGS - 1, Q))
    return ResidualTest(channel, "whiteness", n, Q, LAGS - 1, p, float(rho[worst]), worst + 1.0)


def _input(
    channel: str, name: str, a: Sequence[np.ndarray], x: Sequence[np.ndarray]
) -> ResidualTest:
    n = sum(map(len, a))
    c = _correlations(a, x, INPUT_LAGS)
    reach = MEMORY + INPUT_LAGS[-1]
    rho_a = _correlations(a, a, range(MEMORY + 1)) * (1.0 - np.arange(MEMORY + 1) / (MEMORY + 1))
    rho_x = _correlations(x, x, range(reach + 1))
    tau = np.arange(-MEMORY, MEMORY + 1)
    lags = np.array(INPUT_LAGS)
    at = np.abs(tau[:, None, None] + lags[:, None] - lags[None, :])
    P = np.einsum("t,tjk->jk", rho_a[np.abs(tau)], rho_x[at])
    eigenvalues, V = np.linalg.eigh(P)
    keep = eigenvalues > SINGULAR * eigenvalues[-1]
    T = n * float(((V.T @ c)[keep] ** 2 / eigenvalues[keep]).sum())
    freedom, worst = int(keep.sum()), int(np.argmax(np.abs(c)))
    p = float(chdtrc(freedom, T))
    return ResidualTest(
        channel, name, n, T, freedom, p, float(c[worst]), float(INPUT_LAGS[worst])
    )  # fmt: skip


def _holm(found: Sequence[ResidualTest]) -> tuple[ResidualTest, ...]:
    """p of each test after Holm (1979): max over the smaller ones of (m - rank) p, at most 1."""
    order = sorted(range(len(found)), key=lambda i: found[i].p)
    adjusted, highest = {}, 0.0
    for rank, i in enumerate(order):
        highest = max(highest, min((len(found) - rank) * found[i].p, 1.0))
        adjusted[i] = highest
    return tuple(replace(one, p=adjusted[i]) for i, one in enumerate(found))
