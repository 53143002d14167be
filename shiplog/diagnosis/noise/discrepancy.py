"""The discrepancy: a model's error as functions of its inputs, and of omitted inputs.

Equations of another form leave an acceleration that depends on motion, controls or wind. No model
of forces has one that depends on position, heading or time. Each family is a sum of fixed features
with unknown weights (Kennedy & O'Hagan 2001). The weights of motion, controls and wind are
estimated from the nominal campaign. An unknown structure of the trial is a change of one family's
weights. In channel c, at node j, with the conditions xⱼ there,

    a_c(tⱼ) = q_c Σ_families (1/√F) Σ_f φ_f(xⱼ) w_cf,   w ~ N(0, s² I)

φ of unit mean square over the campaigns, q_c the standard deviation of the process noise: a size s
of a family is the acceleration that it is expected to make, in units of process noise.

Features of motion, controls and wind are the products of ship hydrodynamics (Abkowitz 1964; moduli
after Fedyaevsky & Sobolev 1964) and smooth random features (Rahimi & Recht 2007). A dependence on
position, heading or time acts from outside the ship. Its first features are a force along the
earth's axes that is steady or grows evenly, such as a line's or a tug's; smooth features follow.
The even force is expected to be larger than the others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.diagnosis.linear import segment_nodes
from shiplog.diagnosis.linear.segment_nodes import Nodes
from shiplog.diagnosis.linear.segments import Cut, SegmentGrid
from shiplog.models.mmg import geometry
from shiplog.nomenclature import frames
from shiplog.ship_profile.profile import Actuator, Profile

MODELLED = ("motion", "controls", "wind")  # by a model of forces
OMITTED = ("position", "heading", "time")
EVEN = {"position": 3, "heading": 1, "time": 2}  # features of an even force, the first ones
HARD_OVER = np.deg2rad(35.0)  # of most rudders (SOLAS II-1/29)
WAVES = {"motion": 10, "controls": 10, "wind": 4, "position": 14, "heading": 6, "time": 5}


@dataclass(frozen=True)
class Waves:
    """Smooth features of inputs z [..., n], standardised: √(2/F) cos(z·frequency + phase).

    middle, width  [n] mean and standard deviation over the campaigns
    frequency      [n, F]; phase [F]
    """

    middle: np.ndarray
    width: np.ndarray
    frequency: np.ndarray
    phase: np.ndarray

    def __call__(self, z: np.ndarray) -> np.ndarray:
        """√(2/F) cos((z - m)/s · ω_f + φ_f) [..., F]."""
        scaled = (z - self.middle) / self.width
        return np.sqrt(2.0 / len(self.phase)) * np.cos(scaled @ self.frequency + self.phase)


@dataclass(frozen=True)
class Family:
    """One family: `columns` of the discrepancy's weights, and its features at the nodes.

    level    [F] subtracted from each feature, and scale [F] by which it is divided, both over the
             campaigns; F with the features of an even force
    """

    name: str
    profile: Profile
    waves: Waves
    level: np.ndarray
    scale: np.ndarray
    columns: np.ndarray

    def features(self, nodes: Nodes) -> np.ndarray:
        """I₃ ⊗ φ/√F [S, J, 3, 3F], φ_f = (feature - level)/scale: acceleration of each weight, in
        units of the process noise. Features of the position and of an even force are turned into
        body axes; those of an even force come first, and are not divided by √F."""
        values = (features(self.name, self.profile, self.waves, nodes) - self.level) / self.scale
        plain = EVEN.get(self.name, 0)
        out = segment_nodes.repeat_for_channels(
            values[..., plain:] / np.sqrt(values.shape[-1] - plain)
        )
        if self.name == "position":
            out = _turned(out, nodes)
        if not plain:
            return out
        even = segment_nodes.repeat_for_channels(values[..., :plain])
        even[..., 2, 2 * plain] = 0.0  # a steady moment is the ship's own
        return np.concatenate((_turned(even, nodes), out), -1)


@dataclass(frozen=True)
class Discrepancy:
    """All families of one ship. acceleration [3]: the unit of each channel's acceleration."""

    families: tuple[Family, ...]
    acceleration: np.ndarray

    @property
    def count(self) -> int:
        return sum(len(family.columns) for family in self.families)

    def accelerations(self, cut: Cut, g: SegmentGrid) -> np.ndarray:
        """Φ [S, 3J, W]: acceleration of each weight at the nodes, channel by channel, m/s² and
        rad/s²; times the factors of the causes that scale a family's forces."""
        if not self.families:
            return np.zeros((len(cut), 3 * g.nodes, 0))
        nodes = segment_nodes.conditions_at_nodes(cut, g)
        parts = []
        for family in self.families:
            of = family.features(nodes)
            if family.name in cut.factors:
                of = of * cut.factors[family.name][:, None]
            parts.append(segment_nodes.accelerations(of, self.acceleration))
        return np.concatenate(parts, axis=-1)


def build(
    profile: Profile, acceleration: np.ndarray, first: int, names: Sequence[str], *campaigns: Nodes
) -> Discrepancy:
    """The families that these campaigns can show anything of.

    first   column of the first weight
    """
    found: list[Family] = []
    for name in names:
        if name == "wind" and not profile.has_wind:
            continue
        waves = _waves(name, *campaigns)
        if waves is None:
            continue
        parts = [features(name, profile, waves, nodes) for nodes in campaigns]
        both = np.concatenate([values.reshape(-1, values.shape[-1]) for values in parts])
        # a constant force depends on nothing
        level = both.mean(0) if name in OMITTED else np.zeros(both.shape[-1])
        level[: EVEN.get(name, 0)] = 0.0  # but along the earth's axes it depends on the heading
        scale = np.sqrt(((both - level) ** 2).mean(0))
        # a feature that hardly varies says nothing, and must not be blown up
        scale = np.maximum(scale, 1e-3 * max(float(scale.max()), 1e-9))
        columns = np.arange(first, first + 3 * len(level))
        first += len(columns)
        found.append(Family(name, profile, waves, level, scale, columns))
    return Discrepancy(tuple(found), acceleration)


def _waves(name: str, *campaigns: Nodes) -> Waves | None:
    """√(2/F) cos(z · ω_f + φ_f), z [n] standardised, ω_f ~ N(0, I/max(n/2, 1)), φ_f ~ U(0, 2π)
    (Rahimi & Recht 2007), drawn once a family; of the heading its harmonics, cos kψ and sin kψ.
    None where nothing of the family varies."""
    z = np.concatenate([v.reshape(-1, v.shape[-1]) for v in (_inputs(name, k) for k in campaigns)])
    width = z.std(0)
    if not (width > 1e-9).any():
        return None
    count = WAVES[name]
    if name == "heading":  # harmonics of one angle: cosine and sine come from the phase
        order = np.arange(count) // 2 + 1
        phase = np.where(np.arange(count) % 2, -0.5 * np.pi, 0.0)
        return Waves(np.zeros(1), np.ones(1), order[None].astype(float), phase)
    rng = np.random.default_rng([len(name), *name.encode()])
    frequency = rng.standard_normal((z.shape[1], count)) / np.sqrt(max(z.shape[1] / 2.0, 1.0))
    phase = rng.uniform(0.0, 2.0 * np.pi, count)
    return Waves(z.mean(0), np.where(width > 1e-9, width, 1.0), frequency, phase)


def features(name: str, profile: Profile, waves: Waves, nodes: Nodes) -> np.ndarray:
    """Features of a family at the nodes [S, J, F], before level and scale: products of ship
    hydrodynamics, or of an even force, then the smooth ones."""
    inputs = _inputs(name, nodes)
    smooth = waves(inputs)
    if name in OMITTED:
        return np.concatenate((_even(name, inputs, waves), smooth), -1)
    products = PRODUCTS.get(name)
    if products is None:
        return smooth
    return np.concatenate((*products(profile, nodes), smooth), -1)


def _even(name: str, inputs: np.ndarray, waves: Waves) -> np.ndarray:
    """(1, (x - m)/s) [S, J, EVEN] of a force along the earth's axes: steady, and growing with each
    input x, of mean m and standard deviation s over the campaigns."""
    steady = np.ones_like(inputs[..., :1])
    if name == "heading":  # felt by the ship, a steady force already turns with it
        return steady
    return np.concatenate((steady, (inputs - waves.middle) / waves.width), -1)


def _inputs(name: str, nodes: Nodes) -> np.ndarray:
    """What a family depends on [S, J, n], SI: (x₀, y₀), ψ, the share of the campaign, (u, v, r),
    actuators and u, or the apparent flow of the air."""
    state, driven = nodes.state, nodes.driven
    if name == "position":
        return state[..., [0, 2]]
    if name == "heading":
        return state[..., [4]]
    if name == "time":
        return driven[..., [-3]]
    if name == "motion":
        return state[..., [1, 3, 5]]
    if name == "controls":
        return np.concatenate((driven[..., :-3], state[..., [1]]), -1)
    return apparent_flow(nodes)


def apparent_flow(nodes: Nodes) -> np.ndarray:
    """(u_A, v_A) = Rᵀ(ψ) W + (u, v) [..., 2]: where the apparent wind comes from, ahead and to
    starboard, of the true wind W (where that comes from, over the water) [m/s]."""
    state = nodes.state
    c, s = np.cos(state[..., 4]), np.sin(state[..., 4])
    ahead, starboard = frames.in_body_axes(nodes.driven[..., -2], nodes.driven[..., -1], c, s)
    return np.stack((ahead + state[..., 1], starboard + state[..., 3]), -1)


def _motion_products(profile: Profile, nodes: Nodes) -> list[np.ndarray]:
    """u, v, r, u|u|, v|v|, r|r|, uv, ur, vr, |u|v, |u|r, |v|r, |r|v (Abkowitz 1964; moduli after
    Fedyaevsky & Sobolev 1964)."""
    u, v, r = (nodes.state[..., [i]] for i in (1, 3, 5))
    return [
        u, v, r, u * np.abs(u), v * np.abs(v), r * np.abs(r), u * v, u * r, v * r,
        np.abs(u) * v, np.abs(u) * r, np.abs(v) * r, np.abs(r) * v,
    ]  # fmt: skip


def _control_products(profile: Profile, nodes: Nodes) -> list[np.ndarray]:
    """n|n|, |n|u and n³ of every unit that drives, n in rev/s; of every angle δ

        sin δ u|u|,  1 - cos δ,  n|n| sin δ,  n|n| (1 - cos δ)   of each unit of `driving_units`,
        n³ sin δ,  n³ (1 - cos δ)                                where it turns that unit's thrust,
        sin(πδ/δ_max) u|u|,  sin(πδ/δ_max) n|n|                  of a rudder,

    whose force need not grow with its angle (stall, play, a stop). Nor need thrust grow with the
    square of the order: n³ bends its curve at small orders against large ones, which a limit or a
    dead band would do, too."""
    u = nodes.state[..., [1]]
    driving = [i for i, a in enumerate(profile.actuators) if a.kind in ("propeller", "thruster")]
    found = []
    for i in driving:
        n = nodes.driven[..., [i]]
        found += [n * np.abs(n), np.abs(n) * u, n**3]
    for i, actuator in enumerate(profile.actuators):
        if actuator.kind not in ("rudder", "azimuth"):
            continue
        angle = nodes.driven[..., [i]]
        found += [np.sin(angle) * u * np.abs(u), 1.0 - np.cos(angle)]
        bent = []
        if actuator.kind == "rudder":
            bent = [np.sin(np.pi * angle / largest_angle(actuator))]
        for j in driving_units(profile, i, driving):
            thrust = nodes.driven[..., [j]] * np.abs(nodes.driven[..., [j]])
            found += [thrust * np.sin(angle), thrust * (1.0 - np.cos(angle))]
            if actuator.kind == "azimuth":
                cubic = nodes.driven[..., [j]] ** 3
                found += [cubic * np.sin(angle), cubic * (1.0 - np.cos(angle))]
            found += [thrust * shape for shape in bent]
        found += [shape * u * np.abs(u) for shape in bent]
    return found


def largest_angle(rudder: Actuator) -> float:
    """The largest angle of a rudder, rad: of its limits, or 35 degrees without any."""
    return geometry.reach(rudder) or HARD_OVER


def driving_units(profile: Profile, angle: int, driving: list[int]) -> list[int]:
    """Units whose jet an angle turns: those at the same place, or else the first two."""
    place = profile.actuators[angle].position_m
    same = [j for j in driving if profile.actuators[j].position_m == place]
    return same or driving[:2]


def _wind_products(profile: Profile, nodes: Nodes) -> list[np.ndarray]:
    """U_A² cos kα and U_A² sin kα, k = 1, 2, 3: harmonics of the apparent wind's angle α."""
    wind = apparent_flow(nodes)
    square, angle = (wind**2).sum(-1, keepdims=True), np.arctan2(wind[..., [1]], wind[..., [0]])
    return [square * wave(k * angle) for k in (1, 2, 3) for wave in (np.cos, np.sin)]


PRODUCTS: dict[str, Callable[[Profile, Nodes], list[np.ndarray]]] = {
    "motion": _motion_products, "controls": _control_products, "wind": _wind_products,
}  # fmt: skip


def _turned(out: np.ndarray, nodes: Nodes) -> np.ndarray:
    """(X, Y) = Rᵀ(ψ) (X₀, Y₀): what pulls towards a place pulls along the earth's axes; turned into
    the body's, in place."""
    heading = nodes.state[..., [4]]
    north, east = out[..., 0, :].copy(), out[..., 1, :].copy()
    out[..., 0, :], out[..., 1, :] = frames.in_body_axes(
        north, east, np.cos(heading), np.sin(heading)
    )
    return out
