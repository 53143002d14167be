"""How the apparent wind follows the ship's own velocity: unit and zero of an anemometer.

With a the apparent wind, V the velocity of midship (both over the bow and to starboard, as complex
numbers), ψ the heading and W the wind over ground,

    e^{iψ} a = W + β e^{iψ} V,    W free in each block of time

β is 1, or what hull and mast do to the flow; 1.944 of knots that are called m/s, and e^{iα} of a
vane whose zero is α off: -1 where it says where the wind blows to. A ship that is slow beside the
gusts leaves β open, and with it unit and zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from shiplog.logs.health.health_report import NotCompared

# Measured over free speed at a mast: a fifth more above a bridge, and less in its lee (Moat,
# Yelland and Molland, 2004). Whatever lies within is no other unit.
FLOW = (0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3)
SLOPES = {  # β of each reading of the speed: in words, and the reason
    -1.0: ("where it blows to", "frame"),
    3600 / 1852: ("in knots that are called m/s", "unit"),
    3.6: ("in km/h that are called m/s", "unit"),
    1852 / 3600: ("in m/s that are called knots", "unit"),
    1 / 3.6: ("in m/s that are called km/h", "unit"),
}
BLOCK_S = 100  # s over which the wind's slow change is taken out of β
BLOCKS = 5  # fewer give β no standard error
NEAR = 0.15  # share by which β may be off a known one: the hull's flow, and gusts
# Between β and any flow past a hull: of Student's t with a block less than there are, on one side;
# four standard errors where these are many, and seven of nine blocks.
SURE, NINETY = 1.0 - 3e-5, 0.95
TURNED = math.radians(45.0)  # of the vane's zero, and more: no hull turns the air so far
SLOW, FASTER = "the ship is slow compared with the gusts", "changes of a higher speed, or less wind"
UNIT_OPEN = NotCompared("the wind's unit", SLOW, FASTER)
ZERO_OPEN = NotCompared("whether the wind blows from or to, and the vane's zero", SLOW, FASTER)


@dataclass(frozen=True)
class Slope:
    """β with the standard errors of its real and its imaginary part, from so many blocks."""

    value: complex
    error: float
    error_aside: float
    blocks: int = 0

    @property
    def known(self) -> float | None:
        """The reading of the speed that β is near to, where it is far from all that a hull does."""
        reach, beta = self._sure * self.error, self.value.real
        if not math.isfinite(reach) or min(FLOW) - reach < beta < max(FLOW) + reach:
            return None
        known = min(SLOPES, key=lambda slope: abs(beta / slope - 1.0))
        return known if abs(beta / known - 1.0) <= NEAR else None

    @property
    def turned(self) -> float:
        """α [rad] where the vane is turned beyond doubt, and the unit is right; else 0."""
        angle, reach = abs(self._angle), self._reach
        if not math.isfinite(reach) or angle < TURNED or not self._within(1.0):
            return 0.0
        # distance from the sector within ± TURNED of ahead
        apart = abs(self.value) * math.sin(min(angle - TURNED, 0.5 * math.pi))
        return self._angle if apart > reach else 0.0

    @property
    def open_(self) -> tuple[NotCompared, ...]:
        """What β does not exclude: another unit of the speed, and a vane that is turned far."""
        if not math.isfinite(self._reach):
            return UNIT_OPEN, ZERO_OPEN
        unit = not self._within(1.0) or any(self._within(k) for k in SLOPES if k > 0.0)
        angle = abs(self._angle)
        edge = abs(self.value) * math.sin(TURNED - min(angle, TURNED))
        return (UNIT_OPEN,) * unit + (ZERO_OPEN,) * (edge < self._reach)

    def half(self, error: float) -> float:
        """Of a 90 % interval."""
        return float(stdtrit(self.blocks - 1, NINETY)) * error

    @property
    def _sure(self) -> float:
        return float(stdtrit(max(self.blocks - 1, 1), SURE))

    @property
    def _angle(self) -> float:
        return math.atan2(self.value.imag, self.value.real)

    @property
    def _reach(self) -> float:
        return self._sure * max(self.error, self.error_aside)

    def _within(self, unit: float) -> bool:
        """Whether |β| may be what a hull makes of this unit."""
        reach, size = self._reach, abs(self.value)
        return unit * min(FLOW) - reach < size < unit * max(FLOW) + reach


def slope(speed: np.ndarray, angle: np.ndarray, heading: np.ndarray, velocity: np.ndarray) -> Slope:
    """β by least squares over [n] seconds; its standard errors between the blocks (Liang and
    Zeger, 1986), infinite where too little is known."""
    air = speed * np.exp(1j * (angle + heading))
    moved = velocity * np.exp(1j * heading)
    products, squares = [], []
    for begin in range(0, len(air) - BLOCK_S + 1, BLOCK_S):
        rows = slice(begin, begin + BLOCK_S)
        along = moved[rows] - moved[rows].mean()
        products.append(complex((air[rows] * along.conj()).sum()))
        squares.append(float((np.abs(along) ** 2).sum()))
    if len(squares) < BLOCKS or sum(squares) == 0.0:
        return Slope(1.0, math.inf, math.inf)
    product, square = np.array(products), np.array(squares)
    beta = complex(product.sum() / square.sum())
    left = product - beta * square
    scale = math.sqrt(len(square) / (len(square) - 1)) / float(square.sum())
    of_real, of_imag = (
        scale * math.sqrt(float((part**2).sum())) for part in (left.real, left.imag)
    )
    return Slope(beta, of_real, of_imag, len(square))
