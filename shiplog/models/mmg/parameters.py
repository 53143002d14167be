"""The coefficients of the MMG model: symbol, plausible spread and physical range of each.

One table; a force function looks its numbers up by these names. A file of published values is a
TOML of the same sections and keys, next to the ship's profile: `<profile>.mmg.toml`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from importlib import resources
from pathlib import Path

from shiplog.exceptions import ProfileError, listed, nearest
from shiplog.models import coefficients
from shiplog.models.coefficients import ParameterEntry, Parameters
from shiplog.models.mmg import estimate
from shiplog.models.mmg.estimate import Particulars
from shiplog.models.mmg.geometry import Geometry

_E = ParameterEntry
TABLE: dict[str, dict[str, ParameterEntry]] = {
    "body": {  # added masses are known best: every force and mass share one scale, this fixes it
        "m_x": _E("m'_x", "added mass ahead", 0.08, 0.005, 0.0, 1.0),
        "m_y": _E("m'_y", "added mass athwart", 0.08, 0.0, 0.01, 2.0),
        "i_j": _E("I'+J'", "yaw inertia with added inertia", 0.08, 0.0, 0.001, 0.2),
    },
    "hull": {
        "x_0f": _E("X'₀F", "resistance ahead", 0.3, 0.003, -0.5, 0.0),
        "x_0a": _E("X'₀A", "resistance astern", 0.3, 0.003, -0.5, 0.0),
        "x_vr": _E("X'_vr", "surge force of drifting and turning", 0.3, 0.08, -3.0, 3.0),
        "y_v": _E("Y'_v", "sway damping", 0.3, 0.05, -3.0, 0.0),
        "y_r": _E("Y'_r", "sway force of turning", 0.3, 0.04, -1.0, 1.0),
        "n_v": _E("N'_v", "yaw moment of drifting", 0.3, 0.03, -1.0, 0.3),
        "n_r": _E("N'_r", "yaw damping", 0.3, 0.015, -0.5, 0.0),
        "c_d": _E("C_D", "cross-flow drag", 0.3, 0.1, 0.0, 4.0),
        "c_ry": _E("C_rY", "cross-flow: turning in sway", 0.3, 0.3, 0.0, 6.0),
        "c_rn": _E("C_rN", "cross-flow: turning in yaw", 0.3, 0.2, 0.0, 6.0),
        # Linear damping at low speed. The supply vessel of Fossen, Sagatun & Sorensen 1996 has
        # m' = 0.32 times D'' = 0.0358, 0.1183, 0.0308, which is 0.012, 0.038 and 0.010. Spreads
        # are about half of these, and double for estimated ships. Damping takes energy out only
        # if a coupling is below sqrt(0.038 * 0.010) = 0.02: half of that, too.
        "x_u": _E("X'_u", "linear surge damping", 0.0, 0.01, -0.3, 0.001, neutral=0.0),
        "y_vl": _E("Y'_vL", "linear sway damping", 0.0, 0.025, -1.0, 0.002, neutral=0.0),
        "y_rl": _E("Y'_rL", "linear sway force of turning", 0.0, 0.01, -0.2, 0.2, neutral=0.0),
        "n_vl": _E("N'_vL", "linear yaw moment of drifting", 0.0, 0.01, -0.2, 0.2, neutral=0.0),
        "n_rl": _E("N'_rL", "linear yaw damping", 0.0, 0.005, -0.3, 0.001, neutral=0.0),
    },
    "propeller": {
        "k0": _E("k₀", "thrust at rest", 0.15, 0.0, 0.02, 1.0),
        "k1": _E("k₁", "thrust fall with advance", 0.3, 0.0, -1.0, 0.2),
        "k2": _E("k₂", "thrust fall, quadratic", 0.3, 0.05, -1.0, 0.5),
        "t": _E("t", "thrust deduction", 0.3, 0.03, -0.1, 0.7),
        "w_p0": _E("w_P0", "wake", 0.3, 0.05, 0.0, 0.9),
        "tau": _E("τ", "wake loss in drift", 0.3, 0.1, -1.0, 3.0),
        "c_p": _E("C_P", "wake loss in drift, quadratic", 0.3, 0.1, -3.0, 3.0),
        "c3": _E("C₃", "thrust astern, fast", 0.3, 0.03, -1.0, 0.0),
        "c6": _E("C₆", "thrust astern", 0.3, 0.03, -1.0, 0.0),
        "c7": _E("C₇", "thrust astern with advance", 0.3, 0.05, -1.0, 2.0),
        "c10": _E("C₁₀", "advance where astern thrust levels", 0.1, 0.0, -1.0, 0.0),
        "a1": _E("A₁", "side force of the propeller", 0.3, 1e-3, -0.05, 0.05),
        "a2": _E("A₂", "side force of the propeller", 0.3, 1e-3, -0.1, 0.1),
        "a3": _E("A₃", "side force of the propeller", 0.3, 1e-3, -0.05, 0.05),
        "a4": _E("A₄", "side force of the propeller", 0.3, 1e-3, -0.1, 0.1),
        "a5": _E("A₅", "side force of the propeller", 0.3, 1e-3, -0.05, 0.05),
        "a6": _E("A₆", "side force of the propeller", 0.3, 1e-3, -0.1, 0.1),
        "a7": _E("A₇", "side force of the propeller", 0.3, 1e-3, -0.1, 0.1),
        "a8": _E("A₈", "side force of the propeller", 0.3, 1e-3, -0.05, 0.05),
        "b1": _E("B₁", "yaw moment of the propeller", 0.3, 3e-4, -0.02, 0.02),
        "b2": _E("B₂", "yaw moment of the propeller", 0.3, 3e-4, -0.05, 0.05),
        "b3": _E("B₃", "yaw moment of the propeller", 0.3, 3e-4, -0.02, 0.02),
        "b4": _E("B₄", "yaw moment of the propeller", 0.3, 3e-4, -0.05, 0.05),
        "b5": _E("B₅", "yaw moment of the propeller", 0.3, 3e-4, -0.02, 0.02),
        "b6": _E("B₆", "yaw moment of the propeller", 0.3, 3e-4, -0.05, 0.05),
        "b7": _E("B₇", "yaw moment of the propeller", 0.3, 3e-4, -0.05, 0.05),
        "b8": _E("B₈", "yaw moment of the propeller", 0.3, 3e-4, -0.02, 0.02),
    },
    "rudder": {
        "t_r": _E("t_R", "rudder drag deduction", 0.3, 0.05, -0.5, 0.9),
        "a_h": _E("a_H", "rudder force on the hull", 0.3, 0.05, -0.2, 1.5),
        "x_h": _E("x'_H", "where the hull feels the rudder", 0.3, 0.05, -1.0, 0.5),
        "l_r": _E("ℓ'_R", "rudder inflow from turning", 0.3, 0.1, -3.0, 0.5),
        "k_x": _E("k_x", "rudder inflow from the propeller", 0.3, 0.05, 0.0, 2.0),
        "k_xr": _E("k_xr", "rudder inflow from the reversed propeller", 0.3, 0.05, 0.0, 2.0),
        "eps": _E("ε", "rudder inflow from the wake", 0.3, 0.1, 0.2, 3.0),
        "c_pr": _E("C_PR", "rudder inflow while coasting", 0.3, 0.05, -2.0, 2.0),
        "gamma_n": _E("γ_N", "flow straightening to port", 0.3, 0.05, 0.0, 2.0),
        "gamma_p": _E("γ_P", "flow straightening to starboard", 0.3, 0.05, 0.0, 2.0),
        "f_alpha": _E("f_α", "rudder force slope", 0.15, 0.0, 0.3, 6.0),
        "f_3": _E("f₃", "rudder force at large angles", 0.0, 0.3, -0.95, 3.0, neutral=0.0),
        "f_t": _E("f_T", "jet turned along the rudder", 0.0, 0.3, -1.0, 6.0, neutral=0.0),
        "inboard": _E("f_i", "rudder force of the inboard blade", 0.0, 0.3, 0.0, 3.0, neutral=1.0),
    },
    "thruster": {
        "ahead": _E("T₊", "thrust ahead", 1.0, 0.0, 0.0, 1e7, unit="N"),
        "astern": _E("T₋", "thrust astern", 1.0, 0.0, 0.0, 1e7, unit="N"),
        "loss": _E("ℓ_T", "thrust fall with speed", 0.0, 0.5, -1.0, 5.0, neutral=0.0, unit="s/m"),
    },
    "wind": {
        "x0": _E("X_A0", "wind ahead, mean", 0.3, 0.05, -0.5, 0.5),
        "x1": _E("X_A1", "wind ahead", 0.3, 0.1, -2.5, 0.0),
        "x3": _E("X_A3", "wind ahead, 3rd harmonic", 0.3, 0.05, -0.6, 0.6),
        "x5": _E("X_A5", "wind ahead, 5th harmonic", 0.3, 0.05, -0.6, 0.6),
        "y1": _E("Y_A1", "wind athwart", 0.3, 0.1, 0.0, 2.5),
        "y3": _E("Y_A3", "wind athwart, 3rd harmonic", 0.3, 0.05, -0.6, 0.6),
        "y5": _E("Y_A5", "wind athwart, 5th harmonic", 0.3, 0.05, -0.6, 0.6),
        "n1": _E("N_A1", "wind moment", 0.3, 0.03, -0.5, 0.5),
        "n2": _E("N_A2", "wind moment, 2nd harmonic", 0.3, 0.03, -0.5, 0.5),
        "n3": _E("N_A3", "wind moment, 3rd harmonic", 0.3, 0.03, -0.5, 0.5),
    },
}  # fmt: skip


STRONGEST_THRUSTER = 1e6  # N: some 5 MW, as the largest offshore vessels have

_NEEDS = {
    "wind": "[sensors.wind]",
    "propeller": "actuator of kind propeller",
    "rudder": "actuator of kind rudder",
    "thruster": "actuator of kind thruster",
}


def names(geometry: Geometry) -> tuple[str, ...]:
    """The parameters a ship of this geometry has, in order."""
    found = [f"body.{key}" for key in TABLE["body"]]
    for part in geometry.parts:
        if part == "thruster":
            found += [f"thruster.{t.name}_{k}" for t in geometry.thrusters for k in TABLE[part]]
        else:
            found += [f"{part}.{key}" for key in TABLE[part]]
    if len(geometry.rudders) < 2:  # a single blade has no other next to it
        found = [name for name in found if name != "rudder.inboard"]
    return tuple(found)


def estimated(geometry: Geometry, main: Particulars) -> Parameters:
    """Starting values by empirical formulas, with twice the spread of published ones."""
    guess: dict[str, dict[str, float]] = {
        "body": estimate.inertia(main),
        "hull": estimate.hull(main),
        "propeller": estimate.propeller(main),
        "wind": estimate.wind(main),
    }
    if geometry.rudders:
        blade = geometry.rudders[0]
        guess["rudder"] = estimate.rudder(main, blade.area, blade.span)
        if blade.wide:  # a blade made for such angles turns the jet along itself
            guess["rudder"]["f_t"] = guess["rudder"]["f_alpha"]
    if geometry.thrusters:
        # A twentieth of the ship's weight, shared out: between a ferry's bollard pull and a tug's.
        share = min(0.05 * 9.81 * main.mass / len(geometry.thrusters), STRONGEST_THRUSTER)
        guess["thruster"] = {
            f"{t.name}_{k}": share for t in geometry.thrusters for k in ("ahead", "astern")
        }
    found = _from(geometry, guess, "empirical formulas from the particulars", widen=2.0)
    least = estimate.inertia_spread(main)
    spread = found.spread.copy()
    for key, value in least.items():
        at = found.names.index(f"body.{key}")
        spread[at] = max(spread[at], value)
    return replace(found, spread=spread)


def load(path: Path | str, geometry: Geometry, without: Iterable[str] = ()) -> Parameters:
    """Published or identified values. Raises ProfileError naming what is missing or impossible.

    without   forces that are switched off: their sections may stand in the file
    """
    path = Path(path)
    content, source = coefficients.read(path, "MMG")
    for part in content:
        if part in TABLE and part not in (*geometry.parts, *without, "body"):
            raise ProfileError(
                f"{path} has a {part} force, and the ship's profile has no {_NEEDS[part]}.",
                hint=f"add it to the profile, or leave the force out with --without {part}.",
            )
    return _from(geometry, content, source, widen=1.0, path=path)


def published_file(profile_source: str) -> Path | None:
    """The parameter file next to a profile, shipped or the user's own."""
    if not profile_source:
        return None
    if profile_source.endswith(".toml"):
        path = Path(profile_source).with_suffix(".mmg.toml")
    else:
        path = Path(str(resources.files("shiplog") / "profiles" / f"{profile_source}.mmg.toml"))
    return path if path.is_file() else None


def _from(
    geometry: Geometry,
    content: Mapping[str, Mapping[str, float]],
    source: str,
    widen: float,
    path: Path | None = None,
) -> Parameters:
    wanted = names(geometry)
    where = str(path) if path else source
    known = {part: [*keys] for part, keys in TABLE.items()}
    for part, values in content.items():
        if part not in TABLE:
            raise ProfileError(
                f"{where} has a section [{part}] that no force reads{nearest(part, TABLE)}.",
                hint=f"sections are {listed(TABLE)}.",
            )
        if not isinstance(values, Mapping):
            raise ProfileError(
                f"{where}: {part} is {values!r}, not a section.", hint=f"write it as [{part}]."
            )
        for key, value in values.items():
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise ProfileError(
                    f"{where}: {part}.{key} is {value!r}, not a number.", hint="give a number."
                )
            if part == "thruster":
                known[part] = [n.split(".", 1)[1] for n in wanted if n.startswith("thruster.")]
            if key not in known[part] and part in (*geometry.parts, "body"):
                raise ProfileError(
                    f"{where}: {part}.{key} is not a coefficient{nearest(key, known[part])}.",
                    hint=f"[{part}] can hold {listed(known[part], most=40)}.",
                )
    entries = {name: _entry(name) for name in wanted}
    return coefficients.parameters(
        entries, content, source, widen=widen, where=where,
        scale="coefficients are non-dimensional by ½ρL²d",
    )  # fmt: skip


def _entry(name: str) -> ParameterEntry:
    part, key = name.split(".", 1)
    if part == "thruster":
        key = key.rsplit("_", 1)[1]
    return TABLE[part][key]
