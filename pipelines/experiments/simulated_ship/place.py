"""What the place does to the known ship: a shoal that no chart shows, and a charted bank.

`c` holds the numbers of ship and laws (`physics.coefficients`), `h` what is hidden.
"""

from __future__ import annotations

import math

from numba import njit

from pipelines.experiments.simulated_ship.laws import BEDS
from pipelines.experiments.simulated_ship.ship import BANK_EAST

WATER = 998.0  # kg/m³
BANK_SPEED = 0.3  # m/s along the bank, as usual: there any power of it is the square
_SLOPE, _PLATEAU = float(BEDS.index("slope")), float(BEDS.index("plateau"))


@njit
def shoal(c, h, north, east):
    """0 in deep water to 1 at the shallowest: (h₀/h)², h the depth here.

    A ridge falls off its crest as a hyperbola, h² = h₀² (1 + s²/l²) at s metres from it; a slope
    and the edges of a plateau have a smooth bend between h₀ and h = h₀ (1 + s/l). What grows does
    so by a power of draught over depth, as measured in shallow tanks (Kijima, Katsuno, Nakiri &
    Furukawa 1990), each with a power of its own. The masses' own gradient is left out: below
    0.2 N here.
    """
    off = -(north - h.shoal_north) * math.sin(h.shoal_towards) + (east - h.shoal_east) * math.cos(
        h.shoal_towards
    )
    if c.shallow_bed == _SLOPE:
        return 1.0 / (1.0 + _bend(off / h.shoal_length)) ** 2
    if c.shallow_bed == _PLATEAU:
        edge = c.shallow_edge * h.shoal_length
        return 1.0 / (1.0 + _bend((abs(off) - h.shoal_length) / edge)) ** 2
    return 1.0 / (1.0 + (off / h.shoal_length) ** 2)


@njit
def _bend(x):
    """ln(1 + eˣ): 0 far on one side, x far on the other."""
    return x if x > 30.0 else math.log(1.0 + math.exp(x))


@njit
def grown(start, shallow, power):
    """start · (h₀/h)^power with `shallow` (h₀/h)²; the sample logs' powers without `pow`."""
    if shallow == 0.0:
        return 0.0
    if power == 2.0:
        return start * shallow
    if power == 3.0:
        return start * shallow * math.sqrt(shallow)
    return start * shallow ** (0.5 * power)


@njit
def powered(speed, power, alike):
    """|speed|^power, scaled so that it is the square at the speed `alike` [m²/s²]."""
    if power == 2.0:
        return speed**2
    return abs(speed) ** power * alike ** (2.0 - power)


@njit
def bank(c, h, east, u, psi):
    """Suction towards the bank at y₀ = `BANK_EAST` and the moment that turns the leading end out.

    Both grow with a power of the speed along the bank, the square in Norrbin (1974), and fade with
    the gap to one half at l, as 1/(1 + (gap/l)^p) or exponentially (the distance functions of
    Lataire & Vantorre 2008); they are bounded at the wall and nothing behind it.
    """
    gap = BANK_EAST - 0.5 * c.breadth - east
    if gap < -c.breadth:
        return 0.0, 0.0, 0.0
    cos, sin = math.cos(psi), math.sin(psi)
    away = max(gap, 0.0) / h.bank_length
    if c.bank_fading > 0.0:
        near = 0.5**away
    elif c.bank_power == 3.0:  # the sample logs', without `pow`
        near = 1.0 / (1.0 + away**3)
    else:
        near = 1.0 / (1.0 + away**c.bank_power)
    along = powered(u * cos, c.bank_speed_power, BANK_SPEED)
    pull = h.bank * c.bank_suction * 0.5 * WATER * c.length * c.draught * along * near
    lead = u / math.sqrt(u * u + c.bank_lead_speed * c.bank_lead_speed)  # which end leads
    return pull * sin, pull * cos, -c.bank_moment_arm * c.length * pull * cos * lead
