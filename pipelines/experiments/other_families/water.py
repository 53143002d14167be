"""Shallow water, bank and wind, by other laws than those of the diagnosis's catalogue."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from pipelines.experiments.other_families.ship import WATER

AIR = 1.225  # kg/m³
# Clarke, Gedling & Hine (1983) with Sheng's constants, as used by Ankudinov et al. (1990): powers
# of F = h/T - 1 in K₀, K₁, K₂. Sway damping takes (1, 1, 1) of them, yaw damping (1, 1/2, 1/3),
# sway's added mass (1, 2/3, 8/15), yaw's added inertia (1, 2/5, 24/105).
K0 = (1.0, 0.0775, -0.0110, 0.000068)  # F⁰, F⁻², F⁻³, F⁻⁵
K1 = (-0.0643, 0.0724, -0.0113, 0.0000767)  # F⁻¹, F⁻², F⁻³, F⁻⁵
K2 = 0.0342  # F⁻¹
YAW_DAMPING = (1.0 / 2.0, 1.0 / 3.0)
SWAY_MASS = (2.0 / 3.0, 8.0 / 15.0)
YAW_INERTIA = (2.0 / 5.0, 24.0 / 105.0)
BROADEST = 4.0  # B/T to which they hold
RESISTANCE = (0.644, 1.72)  # Millward (1989): form factor grows by 0.644 (T/h)^1.72
CROSS_FLOW_BLOCKAGE = 0.55  # our own: drag goes as (1 - 0.55 (T/h)²)⁻², continuity under the keel
DEEPEST = 8.0  # h/T off the slope, where none of these factors is felt
GROWTHS = ("surge", "sway", "yaw", "cross_flow", "sway_mass", "yaw_inertia")

# Bank: Lataire, Vantorre & Delefortrie (2016): suction decays exponentially with the distance from
# the bank. The resultant acts abaft midship, so that the bow turns away.
BANK_SPEED_POWER = 1.85  # of the speed along the bank
BANK_LEVER = 0.14  # L, abaft midship of the leading end's side


@njit
def growth(keel, breadth_over_draught, out):
    """Factors `GROWTHS` [6] into `out` where the water is (1 + keel) draughts deep."""
    b = min(breadth_over_draught, BROADEST)
    k0 = K0[0] + K0[1] / keel**2 + K0[2] / keel**3 + K0[3] / keel**5
    k1 = K1[0] / keel + K1[1] / keel**2 + K1[2] / keel**3 + K1[3] / keel**5
    k2 = K2 / keel
    z = 1.0 / (1.0 + keel)
    out[0] = 1.0 + RESISTANCE[0] * z ** RESISTANCE[1]
    out[1] = k0 + k1 * b + k2 * b * b
    out[2] = k0 + YAW_DAMPING[0] * k1 * b + YAW_DAMPING[1] * k2 * b * b
    out[3] = 1.0 / (1.0 - CROSS_FLOW_BLOCKAGE * z * z) ** 2
    out[4] = k0 + SWAY_MASS[0] * k1 * b + SWAY_MASS[1] * k2 * b * b
    out[5] = k0 + YAW_INERTIA[0] * k1 * b + YAW_INERTIA[1] * k2 * b * b


@njit
def shallow(keel, along, half, breadth_over_draught, out):
    """The same at `along` [m] up a slope: `keel` on top, `DEEPEST` at its foot, 2 `half` long.

    Over the deep part nothing grows: deep-water coefficients are those at h/T = DEEPEST.
    """
    part = min(max(0.5 + 0.5 * along / half, 0.0), 1.0)
    here = DEEPEST - 1.0 + (keel - DEEPEST + 1.0) * part
    deep = np.empty(6)
    growth(DEEPEST - 1.0, breadth_over_draught, deep)
    growth(here, breadth_over_draught, out)
    for i in range(6):
        out[i] /= deep[i]


@njit
def bank_force(body, strength, reach, gap, heading, u, out):
    """Add the bank's X, Y, N to `out` at `gap` [m] from a bank to the east. N, N m."""
    along = u * math.cos(heading)
    pressure = 0.5 * WATER * body.length * body.draught * abs(along) ** BANK_SPEED_POWER
    pull = strength * pressure * math.exp(-max(gap, 0.0) / reach)
    out[0] += pull * math.sin(heading)
    out[1] += pull * math.cos(heading)
    out[2] -= BANK_LEVER * body.length * pull * math.cos(heading) * math.tanh(u / 0.05)


@njit
def wind_force(w, ahead, starboard, factors, out):
    """Add Blendermann's (1994) wind force to `out`; (ahead, starboard) is where the apparent wind
    comes from [m/s]. Odd-even behaviour comes from its denominator, not from a sine series."""
    speed2 = ahead * ahead + starboard * starboard
    if speed2 == 0.0 or w.lateral == 0.0:
        return
    angle = math.atan2(abs(starboard), ahead)  # 0 to π
    q = 0.5 * AIR * speed2
    along = w.drag_ahead * w.frontal / w.lateral
    twice = math.sin(2.0 * angle)
    bottom = 1.0 - 0.5 * w.delta * (1.0 - along / w.drag_athwart) * twice * twice
    x = -q * w.lateral * along * math.cos(angle) / bottom
    side = q * w.lateral * w.drag_athwart * math.sin(angle) / bottom  # away from the wind
    y = -side if starboard > 0.0 else side
    lever = w.lever - 0.18 * w.length * (angle - 0.5 * math.pi)
    out[0] += x * factors[0]
    out[1] += y * factors[1]
    out[2] += y * lever * factors[2]
