"""The laws of a known ship's water, air and shore: exponents and shares that books do not agree on.

`Laws()` are those of the sample logs; several of their numbers also stand in the catalogue of
causes. A blind case draws its own from its seed, each within the spread of the literature, so that
no diagnosis of it can profit from a form or a number that both sides share.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Literal

import numpy as np

Bed = Literal["ridge", "slope", "plateau"]
Fading = Literal["power", "exponential"]
BEDS: tuple[Bed, ...] = ("ridge", "slope", "plateau")


@dataclass(frozen=True, slots=True)
class Growth:
    """One term in shallow water: times 1 + share · strength · (h₀/h)^power, h₀ at the shallowest.

    The power is that of draught over depth T/h, since the draught is the same everywhere.
    """

    share: float
    power: float


@dataclass(frozen=True, slots=True)
class Shallow:
    """Growth of each term, and the shape of the bed.

    bed   ridge: h² = h₀² (1 + s²/l²); slope: h₀ on one side, deeper and deeper on the other;
          plateau: h₀ within l of the line, deep beyond
    edge  width of the plateau's edge as a share of l
    """

    resistance: Growth = Growth(0.3, 2.0)
    sway_damping: Growth = Growth(0.8, 2.0)  # Y_v
    yaw_damping: Growth = Growth(0.8, 2.0)  # N_r
    sway_turning: Growth = Growth(0.0, 2.0)  # Y_r
    yaw_drift: Growth = Growth(0.0, 2.0)  # N_v
    cross_flow: Growth = Growth(1.2, 3.0)
    added_surge: Growth = Growth(0.0, 2.0)
    added_sway: Growth = Growth(0.7, 2.0)
    added_inertia: Growth = Growth(0.2, 2.0)  # a share of I_zz + J_zz
    bed: Bed = "ridge"
    edge: float = 0.3


@dataclass(frozen=True, slots=True)
class Bank:
    """Suction of a bank: suction · ½ρLT U² · fading(gap), and a moment that turns the bow out."""

    suction: float = 0.15
    moment_arm: float = 0.25  # of the length
    speed_power: float = 2.0  # of the speed along the bank; alike at `BANK_SPEED`
    fading: Fading = "power"  # 1/(1 + (gap/l)^power), or half as much at every l further
    power: float = 3.0
    lead_speed: float = 0.01  # m/s, above which it is clear which end leads


@dataclass(frozen=True, slots=True)
class Hull:
    """Cross-flow drag and low speed."""

    cross_flow_power: float = 2.0  # of the speed across; alike at `CROSS_FLOW_SPEED`
    end_growth: float = 1.0  # times the ship's own growth of drag towards the ends
    end_power: float = 2.0  # of the distance from midship
    end_skew: float = 0.0  # more of it forward, less of it aft
    low_speed: float = 0.0  # m/s, below which linear damping does not fade any further


@dataclass(frozen=True, slots=True)
class Air:
    """Wind force beyond the ship's own harmonics."""

    cross_force: float = 0.0  # δ of Blendermann (1994)
    surge_2: float = 0.0  # X'_2, cos 2γ
    surge_0: float = 0.0  # X'_0, whatever the direction
    sway_2: float = 0.0  # Y'_2, sin 2γ
    yaw_3: float = 0.0  # N'_3, sin 3γ


@dataclass(frozen=True, slots=True)
class Noise:
    """Accelerations at random on an ordinary day, in surge, sway and yaw.

    sigma       standard deviations [m/s², m/s², rad/s²], slow part included
    time        how fast its memory fades [s]
    damping     of the oscillator that filters it; None: of first order, Ornstein-Uhlenbeck
    slow_share  of the variance, in a part that lasts `slow_time` [s]
    burst       standard deviation of the logarithm of its intensity, which changes in
                `burst_time` [s]; 0: as strong at all times
    """

    sigma: tuple[float, float, float] = (3e-4, 3e-4, 2e-4)
    time: tuple[float, float, float] = (4.0, 4.0, 4.0)
    damping: tuple[float, float, float] | None = None
    slow_share: float = 0.0
    slow_time: float = 120.0
    burst: float = 0.0
    burst_time: float = 60.0


@dataclass(frozen=True, slots=True)
class Laws:
    """What a ship obeys in addition to its own coefficients; the defaults made the sample logs."""

    shallow: Shallow = field(default_factory=Shallow)
    bank: Bank = field(default_factory=Bank)
    hull: Hull = field(default_factory=Hull)
    air: Air = field(default_factory=Air)
    noise: Noise = field(default_factory=Noise)


# --- drawn ----------------------------------------------------------------------------------------

# share at the crest (T/h near 2/3, strength 1), and power of T/h; log-uniform. Damping and turning:
# (1 - T/h)^-n - T/h with n = 0.40 C_b B/T for Y_v, 0.425 C_b B/T for N_v, 1.5 - 14.3 T/L for N_r
# (Kijima, Katsuno, Nakiri & Furukawa 1990) for C_b B/T of 1.7 to 3, fitted by powers; the
# polynomials of Ankudinov, Miller, Jakobsen & Daggett (1990) as reviewed by Vantorre (2001) lie
# within. Resistance: 1 + 0.39 (T/h)² (Furukawa et al. 2016) to 1 + 0.57 (T/h)^1.8 (Raven 2016).
# Cross-flow drag: OCIMF (1977). Added mass: Vantorre (2001).
_GROWTH = {
    "resistance": ((0.14, 0.45), (1.5, 2.6)),
    "sway_damping": ((0.40, 1.60), (2.2, 4.5)),
    "yaw_damping": ((0.10, 0.70), (2.5, 5.0)),
    "sway_turning": ((0.05, 0.50), (1.5, 4.0)),
    "yaw_drift": ((0.40, 1.60), (2.2, 4.5)),
    "cross_flow": ((0.70, 2.20), (1.6, 4.0)),
    "added_surge": ((0.10, 0.70), (1.5, 3.5)),
    "added_sway": ((0.40, 1.30), (1.6, 3.6)),
    "added_inertia": ((0.08, 0.40), (1.6, 3.6)),
}


def drawn(rng: np.random.Generator) -> Laws:
    """The laws of one blind ship; the same from the same state of the generator.

    Bank: suction and moment grow with the square of the speed and the inverse of the gap (Norrbin
    1974), or with other powers and exponentials of gap and speed (Lataire & Vantorre 2008).
    Cross-flow: Hooft (1994) has the growth towards the ends differ between bow and stern. Low
    speed: Fossen (2011) blends a linear damping into the quadratic one. Wind: Isherwood (1973) and
    Blendermann (1994), δ of 0.3 to 0.7. The process noise is an oscillator's, and intermittent:
    nobody measured it, so its range is wide.
    """
    return Laws(
        shallow=_shallow(rng),
        bank=Bank(
            suction=_log(rng, 0.07, 0.22),
            moment_arm=_log(rng, 0.08, 0.40),
            speed_power=rng.uniform(1.5, 2.3),
            fading="power" if rng.random() < 0.6 else "exponential",
            power=rng.uniform(1.0, 3.0),
            lead_speed=_log(rng, 0.02, 0.12),
        ),
        hull=Hull(
            cross_flow_power=rng.uniform(1.8, 2.0),
            end_growth=_log(rng, 0.3, 2.0),
            end_power=rng.uniform(1.0, 4.0),
            end_skew=rng.uniform(-0.5, 0.5),
            low_speed=_log(rng, 0.005, 0.05),
        ),
        air=Air(
            cross_force=rng.uniform(0.3, 0.7),
            surge_2=_either(rng) * rng.uniform(0.02, 0.12),
            surge_0=_either(rng) * rng.uniform(0.01, 0.06),
            sway_2=_either(rng) * rng.uniform(0.02, 0.10),
            yaw_3=_either(rng) * rng.uniform(0.004, 0.025),
        ),
        noise=_noise(rng),
    )


def _shallow(rng: np.random.Generator) -> Shallow:
    grown = {
        name: Growth(_log(rng, *share), rng.uniform(*power))
        for name, (share, power) in _GROWTH.items()
    }
    return Shallow(**grown, bed=BEDS[rng.integers(len(BEDS))], edge=_log(rng, 0.15, 0.6))


def _noise(rng: np.random.Generator) -> Noise:
    usual = Noise()
    factor = _thrice(lambda: _log(rng, 0.6, 1.6))
    surge, sway, yaw = (a * b for a, b in zip(usual.sigma, factor, strict=True))
    return Noise(
        sigma=(surge, sway, yaw),
        time=_thrice(lambda: _log(rng, 1.0, 12.0)),
        damping=_thrice(lambda: rng.uniform(0.25, 0.9)),
        slow_share=rng.uniform(0.05, 0.30),
        slow_time=_log(rng, 60.0, 240.0),
        burst=rng.uniform(0.2, 0.6),
        burst_time=_log(rng, 20.0, 120.0),
    )


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform."""
    return float(low * (high / low) ** rng.uniform())


def _either(rng: np.random.Generator) -> float:
    return float(rng.choice((-1.0, 1.0)))


def _thrice(draw: Callable[[], float]) -> tuple[float, float, float]:
    return draw(), draw(), draw()


# --- as numbers -----------------------------------------------------------------------------------


def force_numbers(laws: Laws) -> dict[str, float]:
    """Every number of a force under a flat name: bank_suction, shallow_resistance_power.

    A bed is its place in `BEDS`, an exponential fading is 1.
    """
    found: dict[str, float] = {}
    for part in ("shallow", "bank", "hull", "air"):
        section = getattr(laws, part)
        for one in fields(section):
            value, name = getattr(section, one.name), f"{part}_{one.name}"
            if isinstance(value, Growth):
                found |= {name: value.share, f"{name}_power": value.power}
            elif one.name == "bed":
                found[name] = float(BEDS.index(value))
            elif one.name == "fading":
                found[name] = float(value == "exponential")
            else:
                found[name] = float(value)
    return found
