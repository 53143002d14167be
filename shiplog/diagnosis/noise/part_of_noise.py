"""A force that is a part of the process noise, at the nodes of segments.

a = n + f,   n ~ N(0, λ² Q_n),   f ~ N(0, Q_f),   Q = λ² Q_n + Q_f
f | r ~ N(K â, K V Kᵀ + Q_f - K Q_f),   K = Q_f Q⁻¹,   a | r ~ N(â, V) [3J, 3J]
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.diagnosis.noise import likelihood
from shiplog.diagnosis.noise.likelihood import ProcessNoise

NO_NOISE = 1e-9  # of the process noise, that leaves the intermittent force by itself


def across_at_nodes(
    linear: Linear, d: np.ndarray, process_noise: ProcessNoise
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance of the intermittent force's sway acceleration at the nodes [S, J] of each
    segment, m/s², in r = e - J d of numbers d [C], SI."""
    z, covariance = likelihood.starts_and_accelerations(linear, d, process_noise)
    a, V = z[:, 6:, None], covariance[:, 6:, 6:]
    J = a.shape[1] // 3
    Q = process_noise.kernel(J)
    force_alone = replace(process_noise, acceleration=NO_NOISE * process_noise.acceleration)
    Q_f = force_alone.kernel(J)
    K = Q_f @ np.linalg.inv(Q)
    mean = (K @ a).reshape(len(z), 3, J)
    sway = slice(J, 2 * J)
    not_in_a = (Q_f - K @ Q_f)[..., sway, sway]
    K_sway = K[..., sway, :]
    variance = np.diagonal(
        K_sway @ V @ np.swapaxes(K_sway, -1, -2) + not_in_a, axis1=1, axis2=2
    )  # fmt: skip
    return mean[:, 1], variance
