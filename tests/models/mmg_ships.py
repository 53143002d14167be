"""Ships of the MMG's tests: one rudder and screw, fish tails, twin screws, thrusters."""

from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np

from shiplog.models.mmg import parameters
from shiplog.models.mmg.geometry import geometry_of
from shiplog.models.mmg.model import MMG
from shiplog.models.mmg.parameters import Parameters
from shiplog.ship_profile.profile import Profile

SENSORS = """
[ship]
name = "made up"
length_m = 4.0
breadth_m = 1.0
draught_m = 0.3
mass_kg = 700.0
[sensors.position]
kind = "local"
topic = "/p"
fields = ["x", "y"]
[sensors.velocity]
kind = "body"
topic = "/p"
fields = ["u", "v"]
[sensors.heading]
topic = "/p"
field = "heading"
"""
TWIN = SENSORS + "".join(
    f"""
[[actuators]]
name = "rudder_{side}"
kind = "rudder"
topic = "/a"
field = "rudder_{side}"
unit = "deg"
limits = [-35.0, 35.0]
position_m = [-1.9, {across}]
area_m2 = 0.02
span_m = 0.2
[[actuators]]
name = "screw_{side}"
kind = "propeller"
topic = "/a"
field = "screw_{side}"
unit = "rps"
position_m = [-1.8, {across}]
diameter_m = 0.15
"""
    for side, across in (("port", -0.3), ("starboard", 0.3))
)
TUNNEL = (
    SENSORS
    + """
[[actuators]]
name = "bow"
kind = "thruster"
topic = "/a"
field = "bow"
limits = [-50.0, 100.0]
position_m = [1.5, 0.0]
direction_deg = 90.0
[[actuators]]
name = "pod"
kind = "thruster"
topic = "/a"
field = "pod"
position_m = [-1.0, 0.4]
"""
)


@dataclass(frozen=True)
class Ship:
    """A model with its coefficients, asked with plain numbers."""

    model: MMG
    parameters: Parameters

    def changed(self, **values: float) -> "Ship":
        """Other coefficients: part__key=value."""
        new = {name.replace("__", ".", 1): value for name, value in values.items()}
        assert new.keys() <= set(self.parameters.names)
        pairs = zip(self.parameters.names, self.parameters.values, strict=True)
        array = np.array([new.get(name, value) for name, value in pairs])
        return replace(self, parameters=self.parameters.with_values(array))

    def __getitem__(self, name: str) -> float:
        return float(self.parameters.values[self.parameters.names.index(name)])

    def _arguments(self, u, v, r, heading, wind, actuator):
        still = (0.0,) * self.model.geometry.actuators
        state = (7.0, u, -3.0, v, heading, r)  # the place of a ship drives nothing
        arrays = (self.parameters.values, state, actuator or still, wind)
        return tuple(jnp.array(a, dtype=float) for a in arrays)

    def forces(self, u=0.0, v=0.0, r=0.0, *, heading=0.0, wind=(0.0, 0.0), actuator=None):
        found = self.model.forces(*self._arguments(u, v, r, heading, wind, actuator))
        return {part: np.asarray(force) for part, force in found.items()}

    def acceleration(self, u=0.0, v=0.0, r=0.0, *, heading=0.0, wind=(0.0, 0.0), actuator=None):
        arguments = self._arguments(u, v, r, heading, wind, actuator)
        return np.asarray(self.model.acceleration(*arguments))


def estimated(profile: Profile, without=()) -> Ship:
    g, main, _ = geometry_of(profile, without)
    return Ship(MMG(g), parameters.estimated(g, main))
