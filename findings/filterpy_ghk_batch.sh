#!/usr/bin/env bash
# filterpy 2.0.0: GHKFilter.batch_filter leaves out the acceleration, both its first value and the gain
# k, and gives what a GHFilter of the same g and h gives. A ship that accelerates evenly, without any
# noise, is followed exactly by update, one sample at a time, and not by batch_filter of the same
# filter and data. A guess would be that both agree, as in GHFilter; the texts of both say "g-h".
#
# Seen: "largest error: update 0.000 m, batch_filter 0.283 m; batch_filter of a GHFilter: 0.283 m".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'filterpy==2.0.0' 'numpy==2.4.6' 'scipy==1.17.1'
"$work/venv/bin/python" - <<'P'
import numpy as np
from filterpy.gh import GHFilter, GHKFilter

ACCELERATION, GAINS = 0.2, {"dt": 1.0, "g": 0.6, "h": 0.3}
truth = 0.5 * ACCELERATION * np.arange(1.0, 60.0) ** 2


def error(positions: np.ndarray) -> float:
    return float(np.abs(positions - truth).max())


def both(make: type, **key: float) -> tuple[float, float]:
    """The largest errors of update and of batch_filter."""
    start = {"x": 0.0, "dx": 0.0, **GAINS, **key}
    batch = make(**start).batch_filter(truth)[1:, 0]
    one = make(**start)
    return error(np.array([one.update(z)[0] for z in truth])), error(batch)


ghk, gh = both(GHKFilter, ddx=ACCELERATION, k=0.05), both(GHFilter)
print(
    f"largest error: update {ghk[0]:.3f} m, batch_filter {ghk[1]:.3f} m; "
    f"batch_filter of a GHFilter: {gh[1]:.3f} m"
)
assert abs(gh[0] - gh[1]) < 1e-9 and ghk[0] < 1e-9, (gh, ghk)
assert ghk[1] > 0.25 and ghk[1] == gh[1], f"this has changed: {ghk}"
P
