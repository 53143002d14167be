"""Starting values of the MMG coefficients from main particulars, by published formulas.

For a ship whose coefficients nobody has measured. Non-dimensional as in `parameters`: forces by
½ρLdU², masses by ½ρL²d, yaw inertia by ½ρL⁴d; k = 2d/L. A formula meant for merchant ships is
held at the edge of its data for wider or fuller ones: better a tame start than an extrapolation.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log10, pi, sqrt

import numpy as np

from shiplog.ship_profile.profile import Actuator, Profile, Ship

GRAVITY = 9.80665  # m/s²
VISCOSITY = 1.1e-6  # m²/s, water of 16 °C
SALT, FRESH = 1025.0, 998.0  # kg/m³
ASPECT = 1.5  # span over mean chord of a ship's rudder
BLOCK_COEFFICIENTS = (0.35, 1.0)
FULLEST = 0.2  # C_b B/L; a full tanker's is 0.15, and the regressions are of merchant ships
BROADEST = 0.2  # B/L of the broadest ships of the regressions


@dataclass(frozen=True, slots=True)
class Particulars:
    """What the formulas need to know of a ship, in SI."""

    length: float  # m
    breadth: float  # m
    draught: float  # m
    mass: float  # kg
    block: float  # displaced volume / (L B d)
    x_g: float  # m, ahead of midship
    density: float  # kg/m³, of the water
    frontal_area: float  # m², above water
    lateral_area: float  # m², above water

    @property
    def mass_nd(self) -> float:
        return self.mass / (0.5 * self.density * self.length**2 * self.draught)

    @property
    def fullness(self) -> float:
        """C_b B/L, held at the edge of the regressions' data."""
        return min(self.block * self.breadth / self.length, FULLEST)


def particulars(profile: Profile) -> tuple[Particulars, tuple[str, ...]]:
    """What the profile gives, the rest estimated; and a sentence for each estimate.

    A known mass floats the ship: with no draught given, the block coefficient (0.7 where it too
    is missing) sets it. Areas above water have the proportions of the Esso Osaka's.
    """
    ship, notes = profile.ship, []
    length, breadth, outline = ship.length_m, ship.breadth_m, ship.outline
    long, wide = np.ptp(np.array(outline), axis=0).tolist() if outline else (0.0, 0.0)
    if breadth is None and wide:
        breadth = wide
        notes.append(f"breadth {breadth:.3g} m taken from the outline")
    elif breadth is None:
        breadth = ship.breadth
        notes.append(f"breadth {breadth:.3g} m estimated as a sixth of the length")

    density = profile.site.density
    if density is None:
        density, water = (SALT, "salt") if length > 20.0 else (FRESH, "fresh")
        notes.append(f"water density {density:.0f} kg/m³ taken as {water}, by the ship's length")

    draught, block, mass, floating = _afloat(ship, density, length, breadth)
    notes += floating
    x_g = ship.x_g_m
    if x_g is None:
        x_g = 0.0
        notes.append("centre of gravity assumed amidships")

    frontal, lateral = ship.frontal_area_m2, ship.lateral_area_m2
    beam = wide or breadth
    if frontal is None:
        frontal = 0.57 * beam**2
        notes.append(f"frontal area {frontal:.3g} m² estimated as 0.57 of the breadth squared")
    if lateral is None:
        lateral = 0.355 * (long or length) * beam
        notes.append(f"lateral area {lateral:.3g} m² estimated as 0.355 of length by breadth")
    main = Particulars(length, breadth, draught, mass, block, x_g, density, frontal, lateral)
    return main, tuple(notes)


def _afloat(
    ship: Ship, density: float, length: float, breadth: float
) -> tuple[float, float, float, list[str]]:
    """Draught [m], block coefficient and mass [kg] that go together, and what was estimated."""
    notes: list[str] = []
    draught, block, mass = ship.draught_m, ship.block_coefficient, ship.mass_kg
    if draught is None and mass is not None:
        floating = mass / (density * length * breadth * (block or 0.7))
        draught = max(floating, 0.05 * breadth)  # less is a multihull's, spread over its gap
        if draught == floating:
            how = f"from the mass afloat at a block coefficient of {block or 0.7:.2g}"
        else:
            how = f"as a twentieth of the breadth: the mass alone would give {floating:.3g} m"
        notes.append(f"draught {draught:.3g} m estimated {how}")
    elif draught is None:
        draught = 0.4 * breadth
        notes.append(f"draught {draught:.3g} m estimated as 0.4 of the breadth")
    box = density * length * breadth * draught
    if block is None and mass is not None:
        found = mass / box
        block = _clip(found, *BLOCK_COEFFICIENTS)
        limited = "" if block == found else f", limited from {found:.2g}"
        notes.append(f"block coefficient {block:.2g} estimated from the mass{limited}")
    elif block is None:
        block = 0.7
        notes.append("block coefficient estimated as 0.7")
    if mass is None:
        mass = block * box
        notes.append(f"mass {mass:.3g} kg estimated from the block coefficient {block:.2g}")
    return draught, block, mass, notes


def rudder_size(rudder: Actuator, count: int, p: Particulars) -> tuple[float, float, str]:
    """Area [m²] and span [m] of one of `count` rudders, and a sentence where they are estimated.

    What DNV asks for at least of all rudders together, A = L d/100 (1 + 25 (B/L)²), shared evenly
    (Det Norske Veritas, Rules for Ships, 2000); a span of 1.5 mean chords.
    """
    area, span, notes = rudder.area_m2, rudder.span_m, []
    if area is None:
        if span is None:
            whole = p.length * p.draught / 100.0 * (1.0 + 25.0 * (p.breadth / p.length) ** 2)
            area, how = whole / count, "from length, breadth and draught"
        else:
            area, how = span**2 / ASPECT, f"from its span of {span:.3g} m"
        notes.append(f"area {area:.3g} m² {how}")
    if span is None:
        span = sqrt(ASPECT * area)
        notes.append(f"span {span:.3g} m of {ASPECT} mean chords")
    return area, span, f"{rudder.name}: {' and '.join(notes)} estimated" if notes else ""


def inertia(p: Particulars) -> dict[str, float]:
    """Added masses, and yaw inertia with its added part about the centre of gravity.

    m_x = 2.7 ρ ∇^(5/3)/L² (Söding 1982); m'_y and J' of Clarke, Gedling & Hine 1983, theirs by
    ½ρL³ and ½ρL⁵, hence divided by d/L here; rigid radius of gyration 0.25 L.
    """
    strip = pi * p.draught / p.length
    ratio, full = p.breadth / p.length, p.block * p.breadth / p.draught
    volume = p.mass / p.density
    m_x = 2.7 * volume ** (5 / 3) / p.length**2 / (0.5 * p.length**2 * p.draught)
    # Both brackets turn negative for B/L past 0.3 to 0.5. The lower limits keep 0.4 of a slender
    # body's sway mass and a quarter of its yaw inertia.
    m_y = strip * max(1.0 + 0.16 * full - 5.1 * ratio**2, 0.4)
    j_z = strip * max(1 / 12 + 0.017 * full - 0.33 * ratio, 0.25 / 12)
    m_x = min(m_x, 0.2 * p.mass_nd)  # a ship's is less; a broad box by the formula has twice this
    return {"m_x": m_x, "m_y": m_y, "i_j": 0.25**2 * p.mass_nd + j_z}


def inertia_spread(p: Particulars) -> dict[str, float]:
    """Plausible spreads of sway mass and yaw inertia for a hull broader than the regressions'.

    From B/L of 0.2, the broadest of their ships, to 0.4 they widen to half the way to a catamaran:
    two slender hulls, each with its own strip of added mass (Newman 1977), and their masses 0.4 B
    off the centre line. The Otter has 1.5 of its mass as added sway mass (Fossen 2021), where the
    regressions' lower limit gives 0.3.
    """
    known = inertia(p)
    strip, ratio = pi * p.draught / p.length, p.breadth / p.length
    twin = {
        "m_y": 2.0 * strip,
        "i_j": (0.25**2 + (0.4 * ratio) ** 2) * p.mass_nd + 2.0 * strip / 12.0,
    }
    broad = _clip((ratio - BROADEST) / BROADEST, 0.0, 1.0)
    return {key: 0.5 * broad * max(twin[key] - known[key], 0.0) for key in twin}


def hull(p: Particulars) -> dict[str, float]:
    """Linear derivatives, resistance, and cross-flow drag.

    Y'_v = -(πk/2 + 1.4 C_b B/L), Y'_r = m' + m'_x - 1.5 C_b B/L, N'_v = -k, N'_r = -0.54 k + k²
    (Inoue, Hirano & Kijima 1981; Kijima, Katsuno, Nakiri & Furukawa 1990).
    X'_0F = -(1 + 0.35) C_F S/(L d), C_F of ITTC 1957 at a Froude number of 0.05, S = 1.7 L d + ∇/d
    (Denny-Mumford). Cross-flow form of Yoshimura, Nakao & Ishibashi 2009. The linear damping of
    low speed has no published formula: it is left at its neutral value, for the data to say.
    """
    k = 2.0 * p.draught / p.length
    turning = min(k, 0.27)  # the parabola's turning point: no less damping for more draught
    speed = 0.05 * sqrt(GRAVITY * p.length)
    friction = 0.075 / (log10(speed * p.length / VISCOSITY) - 2.0) ** 2
    wetted = 1.7 * p.length * p.draught + p.mass / (p.density * p.draught)
    ahead = -1.35 * friction * wetted / (p.length * p.draught)
    y_r = p.mass_nd + inertia(p)["m_x"] - 1.5 * p.fullness
    return {
        "x_0f": ahead,
        "x_0a": 1.5 * ahead,  # the Esso Osaka's, going astern, is 1.49
        "x_vr": 0.0,  # the Esso Osaka's is -0.0081
        "y_v": -(pi * k / 2.0 + 1.4 * p.fullness),
        "y_r": min(y_r, 0.9),  # a broad barge's would pass 1
        "n_v": -k,
        "n_r": -0.54 * turning + turning**2,
        # The Esso Osaka's are 0.967, 2.217 and 0.810; 1 and 1 would be the plain cross flow.
        "c_d": 0.95,
        "c_ry": 1.5,
        "c_rn": 1.0,
    }


def propeller(p: Particulars) -> dict[str, float]:
    """Open water, wake and thrust deduction; four quadrants as the Esso Osaka's.

    K_T as a parabola through a four-bladed B-series propeller near P/D 0.75 (Oosterveld & van
    Oossanen 1975); w = 0.5 C_b - 0.05, single screw (Taylor 1933); t = 0.6 w. The rest was
    measured on single-screw tankers (Hachii's form for n < 0) and says little about other ships.
    """
    wake = max(0.5 * p.block - 0.05, 0.1)
    a = (-7.90e-5, 7.99e-3, -4.93e-3, -5.87e-3, -5.58e-4, 5.08e-3, 1.70e-3, 9.16e-4)
    b = (3.50e-5, -3.17e-3, 1.96e-3, 2.33e-3, 2.25e-4, -2.16e-3, 6.27e-5, 6.25e-5)
    return {
        "k0": 0.33,
        "k1": -0.32,
        "k2": -0.16,
        "t": 0.6 * wake,
        "w_p0": wake,
        "tau": 0.871,
        "c_p": -0.359,
        "c3": -0.251,
        "c6": -0.175,
        "c7": 0.33,
        "c10": -0.233,
        **{f"a{i}": value for i, value in enumerate(a, 1)},
        **{f"b{i}": value for i, value in enumerate(b, 1)},
    }


def rudder(p: Particulars, area: float, span: float) -> dict[str, float]:
    """Normal-force slope, hull interaction and inflow of a rudder behind its propeller.

    f_α = 6.13 Λ/(2.25 + Λ), Λ = h²/A_R (Fujii & Tsuda 1961); t_R = 1 - (0.28 C_b + 0.55),
    a_H = 0.627 C_b - 0.153, x'_H = -0.45, γ = 2.06 C_b B/L + 0.14, ℓ'_R = -0.9
    (Kijima et al. 1990); ε and κ = k_x/ε near the KVLCC2's 1.09 and 0.5 (Yasukawa & Yoshimura
    2015); k_xr/k_x and c_PR the Esso Osaka's.
    """
    aspect = span**2 / area
    straightening = _clip(2.06 * p.fullness + 0.14, 0.1, 1.0)
    return {
        "t_r": _clip(1.0 - (0.28 * p.block + 0.55), 0.0, 0.5),
        "a_h": _clip(0.627 * p.block - 0.153, 0.0, 1.0),
        "x_h": -0.45,
        "l_r": -0.9,
        "k_x": 0.55,
        "k_xr": 0.275,
        "eps": 1.1,
        "c_pr": -0.176,
        "gamma_n": straightening,
        "gamma_p": straightening,
        "f_alpha": 6.13 * aspect / (2.25 + aspect),
    }


def wind(p: Particulars) -> dict[str, float]:
    """Fujiwara's coefficients for a superstructure in the Esso Osaka's proportions.

    A boat broader than L/5 gets the coefficients of one that broad and of its height-to-breadth
    ratio. As a last guard X₁ is limited to [-1.5, -0.3], Y₁ to [0.5, 1.4] and the rest to ±0.3.
    """
    narrower = min(1.0, BROADEST * p.length / p.breadth)
    breadth = narrower * p.breadth
    frontal, lateral = narrower**2 * p.frontal_area, narrower * p.lateral_area
    found = fujiwara(
        a_t=frontal,
        a_l=lateral,
        a_od=0.2735 * lateral,
        c=0.0,
        c_br=-0.02 * p.length,
        h_br=1.06 * frontal / breadth,
        h_c=0.6 * lateral / p.length,
        length=p.length,
        breadth=breadth,
    )
    limits = {"x1": (-1.5, -0.3), "y1": (0.5, 1.4)}
    return {key: _clip(value, *limits.get(key, (-0.3, 0.3))) for key, value in found.items()}


def fujiwara(
    a_t: float,
    a_l: float,
    a_od: float,
    c: float,
    c_br: float,
    h_br: float,
    h_c: float,
    length: float,
    breadth: float,
) -> dict[str, float]:
    """Wind coefficients by regression on the ship's shape above water (Fujiwara et al. 1998).

    X = X₀ + X₁ cos g + X₃ cos 3g + X₅ cos 5g, Y = Y₁ sin g + Y₃ sin 3g + Y₅ sin 5g,
    N = N₁ sin g + N₂ sin 2g + N₃ sin 3g, with g counter-clockwise from the bow.

    a_t, a_l, a_od   frontal, lateral, and the superstructure's lateral area [m²]
    c, c_br          centre of a_l, and of the superstructure, ahead of midship [m]
    h_br, h_c        top of the bridge, and centre of a_l, above water [m]
    """
    l_b, l2, b2 = length * breadth, length**2, breadth**2
    front = a_t / (breadth * h_br)
    height = length * h_c / a_l
    bridge = c_br / length
    return {
        "x0": _sum((-0.330, 0.293, 0.0193, 0.682), 1 / front, c / h_c, a_od / l2),
        "x1": _sum(
            (-1.353, 1.700, 2.87, -0.463, -0.570, -6.640, -0.0123, 0.0202),
            *(a_l / l_b, height, length * h_br / a_l, a_od / a_l),
            *(a_t / l_b, l2 / a_t, length / h_c),
        ),
        "x3": _sum(
            (0.830, -0.413, -0.0827, -0.563, 0.804, -5.67, 0.0401, -0.132),
            *(a_l / (length * h_br), a_l / a_t, height, a_od / a_l, a_od / l2, c / h_c, bridge),
        ),
        "x5": _sum((0.0372, -0.0075, -0.103, 0.0921), a_l / a_od, bridge, a_l / l_b),
        "y1": _sum(
            (0.684, 0.717, -3.22, 0.0281, 0.0661, 0.298),
            *(bridge, c / length, a_l / a_od, c / h_c, front),
        ),
        "y3": _sum(
            (-0.400, 0.282, 0.307, 0.0519, 0.0526, -0.0814, 0.0582),
            *(a_l / l_b, height, bridge, breadth / h_br, a_od / a_l, front),
        ),
        "y5": _sum(
            (0.122, -0.166, -0.0054, -0.0481, -0.0136, 0.0864, -0.0297),
            *(a_l / l_b, length / h_br, bridge, b2 / a_t, c / length, c * h_c / a_l),
        ),
        "n1": _sum(
            (0.299, 1.710, 0.183, -1.09, -0.0442, -0.289, 4.24, -0.0646, 0.0306),
            *(c / length, height, a_t / a_l, c / h_c, a_l / l_b, a_t / l2, b2 / a_t, bridge),
        ),
        "n2": _sum(
            (0.117, 0.123, -0.323, 0.0041, -0.166, -0.0109, 0.174, 0.214, -1.06),
            *(bridge, c / length, a_l / a_od, a_t / b2, length / h_br, front),
            *(a_l / l_b, a_l / l2),
        ),
        "n3": _sum((0.0230, 0.0385, -0.0339, 0.0023), bridge, front, a_l / a_t),
    }


def _sum(coefficients: tuple[float, ...], *ratios: float) -> float:
    """c₀ + Σ cᵢ rᵢ."""
    return sum(c * r for c, r in zip(coefficients, (1.0, *ratios), strict=True))


def _clip(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)
