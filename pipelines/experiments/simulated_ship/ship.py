"""The numbers of the known ship, and what can be hidden in it, in its sensors or in the water."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace

import numpy as np

from pipelines.experiments.simulated_ship.gear import Faulty


@dataclass(frozen=True, slots=True)
class Ship:
    """A 3 m tanker model with one propeller between two VecTwin rudders, SI units.

    Size and mass are those of the 3 m Esso Osaka (Miyauchi et al. 2022); everything else is our
    own, of published magnitude. Hull coefficients are divided by ½ρL²d for forces (½ρL³d for
    moments), velocities as in `physics`.
    """

    name: str = "known ship, VecTwin"
    length: float = 3.0
    breadth: float = 0.489
    draught: float = 0.201
    block_coefficient: float = 0.83
    mass: float = 244.6
    gravity_ahead: float = 0.094  # x_G, centre of gravity ahead of midship
    added_surge: float = 17.0  # m_x
    added_sway: float = 221.0  # m_y
    inertia: float = 240.0  # I_zz + J_zz about midship
    # hull: resistance, linear damping, cross-flow
    resistance_ahead: float = 0.0230  # R'_F, ½ρLd u²
    resistance_astern: float = 0.0330
    surge_turning: float = -0.17  # X'_vr
    sway_damping: float = -0.34  # Y'_v
    sway_turning: float = 0.10  # Y'_r
    yaw_drift: float = -0.13  # N'_v
    yaw_damping: float = -0.065  # N'_r
    cross_flow: float = 0.86  # C_D amidships
    cross_flow_ends: float = 0.55  # how much more at the ends, Hooft (1994)
    # propeller
    diameter: float = 0.100
    thrust_0: float = 0.335  # K_T = k₀ + k₁J + k₂J²
    thrust_1: float = -0.310
    thrust_2: float = -0.160
    deduction: float = 0.20  # t
    wake: float = 0.45  # w on a straight course
    propeller_at: float = -1.42  # m ahead of midship
    # each rudder
    rudder_area: float = 0.0103
    rudder_span: float = 0.130
    rudder_at: float = -1.50  # m ahead of midship
    rudder_aside: float = 0.075  # m to starboard (starboard) and to port (port)
    straightening: float = 0.60  # γ_R
    deflected: float = 0.93  # share of the jet's momentum that leaves along the rudder
    spill: float = 0.10  # how much less of it athwart the jet
    outside: float = 0.40  # share of the blade outside the slipstream
    lift_slope: float = 2.6  # per rad
    stall: float = 0.62  # rad
    plate_drag: float = 1.25  # normal force coefficient at right angles
    friction: float = 0.025
    hull_lift: float = 0.20  # a_H
    hull_lift_at: float = -1.30  # x_H
    # what the propeller's rotation does to two rudders of one shape (zero: mirror-symmetric)
    swirl: float = 0.025  # rad, inflow angle towards starboard at either rudder
    port_share: float = 0.515  # of the jet on the port rudder
    # actuators
    rudder_rate: float = 0.349  # rad/s, 20 deg/s
    rudder_time: float = 0.12  # s
    propeller_time: float = 0.6  # s
    # above the water
    frontal_area: float = 0.135
    lateral_area: float = 0.520
    wind_surge: float = 0.80  # X'_1, cos γ
    wind_surge_3: float = -0.07  # X'_3, cos 3γ
    wind_sway: float = 1.02  # Y'_1, sin γ
    wind_sway_3: float = 0.06  # Y'_3, sin 3γ
    wind_yaw: float = 0.020  # N'_1, sin γ
    wind_yaw_2: float = 0.100  # N'_2, sin 2γ

    def symmetrical(self) -> Ship:
        """The same ship with a propeller that does not rotate its jet: port mirrors starboard."""
        return replace(self, swirl=0.0, port_share=0.5)


LIMITS = {  # the paper's table of actuator limits: rad, rad, rev/s
    "rudder_port": (np.deg2rad(-105.0), np.deg2rad(35.0)),
    "rudder_starboard": (np.deg2rad(-35.0), np.deg2rad(105.0)),
    "propeller": (0.0, 12.5),
}
ANTENNA = (0.3, 0.0)  # m ahead of midship and to starboard, as the profile has it
BANK_EAST = 40.0  # m; a charted vertical bank stands along the line y₀ = 40 m
_BUILT = frozenset({  # what a yard keeps: a varied ship has another hull form, not another length
    "name", "length", "breadth", "draught", "block_coefficient", "diameter", "propeller_at",
    "rudder_at", "rudder_aside", "rudder_span", "rudder_area", "rudder_rate",
})  # fmt: skip


def varied(seed: int, spread: float = 0.08) -> Ship:
    """A sister of another yard: each coefficient within ± `spread` of itself."""
    rng = np.random.default_rng([seed, 0x5A11])
    ship = Ship()
    changed = {
        f.name: getattr(ship, f.name) * rng.uniform(1.0 - spread, 1.0 + spread)
        for f in fields(Ship)
        if f.name not in _BUILT
    }
    changed["port_share"] = 0.5 + (ship.port_share - 0.5) * rng.uniform(0.5, 1.5)
    changed["deflected"] = min(changed["deflected"], 0.98)
    return replace(ship, **changed, name=f"{ship.name}, sister {seed}")


@dataclass(frozen=True, slots=True)
class Effects:
    """What is hidden; all zero is nothing. Names as in the contract where it has them.

    Forces act in the integration, below any model; instruments lie before the log is written.
    Measured actuators stay what the shaft and the stocks do.
    """

    # the water and the place
    current_north: float = 0.0  # m/s, where the water goes
    current_east: float = 0.0
    wind_force: tuple[float, float, float] = (0.0, 0.0, 0.0)  # shares added to surge, sway, yaw
    tether: float = 0.0  # N towards a point, outside the catalogue
    tether_north: float = 0.0  # m
    tether_east: float = 0.0
    shallow_water: float = 0.0  # strength of what a shoal that no chart shows does to the hull
    shoal_length: float = 5.0  # m, half-width of its flanks
    shoal_north: float = 0.0  # m, a point its crest passes through
    shoal_east: float = 0.0
    shoal_towards: float = 0.0  # rad, which way the crest runs, clockwise from north
    bank: float = 0.0  # strength of the bank at `BANK_EAST`
    bank_length: float = 5.0  # m off the bank at which half of its effect is left
    turbulence: float = 0.0  # of what pushes at random: 1 is an ordinary day, 4 is outside
    # the ship
    fouling: float = 0.0  # share added to the straight resistance
    cross_flow_drag: float = 0.0  # share added to C_D
    thrust_loss: float = 0.0  # share lost
    thrust_drift: float = 0.0  # share added per campaign, growing from 0
    rudder_force: float = 0.0  # share added to every rudder force
    payload: float = 0.0  # kg
    payload_ahead: float = 0.0  # m ahead of midship
    rudder_offset_port: float = 0.0  # rad, acting minus measured
    rudder_offset_starboard: float = 0.0
    rudder_lag: float = 0.0  # s, first order between measured and acting
    rudder_delay: float = 0.0  # s
    propeller_side_force: float = 0.0  # share of the thrust, to starboard, outside the catalogue
    rudder_limit: float = 0.0  # rad, no rudder acts beyond ± this; 0 is no limit; outside too
    side_thrust: float = 0.0  # N, the strongest pulse of a thruster that nobody records
    gear: tuple[Faulty, ...] = ()  # units that do not do what is recorded
    external: Mapping[str, float] = field(default_factory=dict)  # lines, tows, fenders: `gear`
    # the instruments
    heading_offset: float = 0.0  # rad, measured minus true
    yaw_rate_bias: float = 0.0  # rad/s, measured minus true
    yaw_rate_scale: float = 0.0  # measured over true, less one
    antenna_offset: tuple[float, float] = (0.0, 0.0)  # m ahead, starboard: mounted minus profile
    wind_direction_offset: float = 0.0  # rad, measured minus true
    wind_speed_scale: float = 0.0  # measured over true, less one
    # s late against the heading, by channel: position, velocity, gnss (both), yaw_rate, wind
    clock_offset: Mapping[str, float] = field(default_factory=dict)
    # not causes but the manners of every instrument
    coloured: float = 0.0  # share of its quick noise that fades over 1 to 5 s
    clock_jitter: float = 0.0  # s, standard deviation of a stamp from the instant measured
