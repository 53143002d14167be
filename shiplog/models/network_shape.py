"""What makes two networks interchangeable; known without the library that trains them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Shape:
    """Inputs and layers of a network.

    wind_input  "angle" is the paper's: U_A and γ_A in [0, 2π), which jumps at the bow;
                "components" is U_A cos γ_A and U_A sin γ_A, which does not
    input_tanh  the paper's table gives its input layer an activation; off is the common reading
    """

    actuators: int
    wind: bool = True
    width: int = 256
    depth: int = 4
    wind_input: str = "angle"
    input_tanh: bool = False

    @property
    def inputs(self) -> int:
        return 3 + self.actuators + (2 if self.wind else 0)
