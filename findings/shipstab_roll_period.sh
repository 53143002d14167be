#!/usr/bin/env bash
# shipstab 0.1.0: a ship's natural roll period, and the wave periods that it warns of because of
# parametric roll, are half of what they are. Its formula is C B / sqrt(GM) with the coefficients C of
# 0.373 to 0.487 of the IMO's 2 C B / sqrt(GM) (2008 IS Code, part A, 2.3.4), where C is about the radius
# of gyration over the beam. A guess would be the IMO's period: that of a pendulum with this radius.
#
# Seen: "beam 10 m, GM 1.58 m: 2.96 s, waves of 1.48 and 2.96 s; 2 C B / sqrt(GM): 5.93 s; radius of
# gyration 0.373 B: 5.95 s".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'shipstab==0.1.0' 'numpy==2.4.6' 'scipy==1.17.1'
"$work/venv/bin/python" - <<'P'
from math import pi, sqrt

from shipstab.core.hull import Hull
from shipstab.stability.dynamic import DynamicStability
from shipstab.vessel import Vessel

LENGTH, BEAM, DRAUGHT, KG, C = 60.0, 10.0, 2.5, 3.0, 0.373
heights = [0.5 * level for level in range(7)]
offsets = {6.0 * station: dict.fromkeys(heights, BEAM / 2.0) for station in range(11)}
ship = Vessel("barge", Hull(offsets, LBP=LENGTH)).set_draft(DRAUGHT).set_KG(KG)
rolling = DynamicStability(ship.intact_stability)
period = float(rolling.natural_roll_period(C=C, beam=BEAM))
ship.B = BEAM
warned = rolling.parametric_rolling_susceptibility()
waves = warned["critical_wave_period_1"], warned["critical_wave_period_2"]
height = DRAUGHT / 2.0 + BEAM**2 / (12.0 * DRAUGHT) - KG
imo = 2.0 * C * BEAM / sqrt(height)
pendulum = 2.0 * pi * C * BEAM / sqrt(9.80665 * height)
print(
    f"beam {BEAM:g} m, GM {height:.2f} m: {period:.2f} s, waves of {waves[0]:.2f} and {waves[1]:.2f} "
    f"s; 2 C B / sqrt(GM): {imo:.2f} s; radius of gyration {C:g} B: {pendulum:.2f} s"
)
assert abs(ship.intact_stability.GM - height) < 0.01, ship.intact_stability.GM
assert abs(period - imo / 2.0) < 0.01, f"this has changed: {period}"
assert abs(waves[1] - period) < 0.01, f"this has changed: {waves}"
P
