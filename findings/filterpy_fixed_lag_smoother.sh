#!/usr/bin/env bash
# filterpy 2.0.0: FixedLagSmoother with a lag of one sample is further from the truth than the Kalman
# filter without any smoothing is, of the same model and data, and with a lag of four it is worse than
# what the four later samples allow (the package's own rts_smoother, given the data up to each sample's
# lag). The model is the one that made the data, so that a guess would be that both agree.
#
# Seen: "rms error of the position: filter 1.064; lag 1: 1.084 (possible 0.899); lag 4: 0.730
# (possible 0.612)".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'filterpy==2.0.0' 'numpy==2.4.6' 'scipy==1.17.1'
"$work/venv/bin/python" - <<'P'
import numpy as np
from filterpy.kalman import FixedLagSmoother, KalmanFilter

NOISE, ACCELERATION, COUNT = 2.0, 0.1, 3000  # standard deviations of a position, of its drift


def ship(kind: type, **key: int) -> KalmanFilter | FixedLagSmoother:
    model = kind(dim_x=2, dim_z=1, **key)
    model.F = np.array([[1.0, 1.0], [0.0, 1.0]])
    model.H = np.array([[1.0, 0.0]])
    model.x, model.P = np.zeros((2, 1)), np.eye(2) * 10.0
    model.R = np.array([[NOISE**2]])
    model.Q = np.array([[0.25, 0.5], [0.5, 1.0]]) * ACCELERATION**2
    return model


random = np.random.default_rng(0)
state, truth, measured = np.zeros(2), [], []
for _ in range(COUNT):
    a = random.normal() * ACCELERATION
    state = np.array([state[0] + state[1] + a / 2, state[1] + a])
    truth.append(state[0])
    measured.append(state[0] + random.normal() * NOISE)
inner = slice(50, COUNT - 50)


def error(positions: np.ndarray) -> float:
    return float(np.sqrt(np.mean((positions - truth)[inner] ** 2)))


filter_ = ship(KalmanFilter)
means, covariances, _, _ = filter_.batch_filter(measured)


def fixed_lag(lag: int) -> float:
    smoother = ship(FixedLagSmoother, N=lag)
    for z in measured:
        smoother.smooth(z)
    return error(np.array(smoother.xSmooth)[:, 0, 0])


def possible(lag: int) -> float:
    found = np.zeros(COUNT)
    for k in range(COUNT - lag):
        upto = slice(k, k + lag + 1)
        found[k] = filter_.rts_smoother(means[upto], covariances[upto])[0][0, 0, 0]
    return error(found)


plain = error(means[:, 0, 0])
lags = {lag: (fixed_lag(lag), possible(lag)) for lag in (1, 4)}
told = "; ".join(f"lag {lag}: {is_:.3f} (possible {best:.3f})" for lag, (is_, best) in lags.items())
print(f"rms error of the position: filter {plain:.3f}; {told}")
assert lags[1][1] < 0.9 * plain < plain < lags[1][0], "this has changed"
assert lags[4][0] > 1.15 * lags[4][1], "this has changed"
P
