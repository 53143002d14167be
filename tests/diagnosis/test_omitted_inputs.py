"""Planted dependences on what the model cannot see, their size known, and none where none is."""

import afloat
import numpy as np
import polars as pl
import pytest

from shiplog.diagnosis.noise.residual_acceleration import ACCELERATIONS
from shiplog.diagnosis.residual import omitted_inputs

NODES = 250  # of 2 s a voyage


def wandering(rng: np.random.Generator, count: int, time: float) -> np.ndarray:
    """Unit variance, forgotten over `time` nodes."""
    kept, values = np.exp(-1.0 / time), rng.standard_normal(count)
    for i in range(1, count):
        values[i] = kept * values[i - 1] + np.sqrt(1.0 - kept**2) * values[i]
    return values


def campaign(voyages: int = 5, seed: int = 0) -> pl.DataFrame:
    """Nodes of voyages on one pond; the accelerations are white, of unit variance."""
    rng = np.random.default_rng(seed)
    parts = []
    for voyage in range(voyages):
        motion = {c: wandering(rng, NODES, 8.0) for c in ("surge", "sway", "yaw_rate")}
        heading = rng.uniform(-np.pi, np.pi) + np.cumsum(0.3 * motion["yaw_rate"])
        parts.append(
            {c: rng.standard_normal(NODES) for c in ACCELERATIONS}
            | motion
            | {
                "voyage": np.repeat(f"v{voyage}", NODES), "time_s": 2.0 * np.arange(NODES),
                "x0": 20.0 * wandering(rng, NODES, 25.0),
                "y0": 20.0 * wandering(rng, NODES, 25.0),
                "heading": np.arctan2(np.sin(heading), np.cos(heading)),
                "rudder_port": 0.4 * wandering(rng, NODES, 4.0),
                "rudder_starboard": 0.4 * wandering(rng, NODES, 4.0),
                "propeller": 8.0 + 2.0 * wandering(rng, NODES, 6.0),
                "wind_ahead": 2.0 * wandering(rng, NODES, 30.0),
                "wind_starboard": 2.0 * wandering(rng, NODES, 30.0),
                "share": (voyage + (np.arange(NODES) + 0.5) / NODES) / voyages,
            }
        )  # fmt: skip
    return pl.concat([pl.DataFrame(p) for p in parts])


def planted(nodes: pl.DataFrame, effect: np.ndarray, channel: str) -> pl.DataFrame:
    """`effect`, brought to the variance of the noise: half of all is explained."""
    name = ACCELERATIONS[omitted_inputs.CHANNELS.index(channel)]
    noise = nodes[name].to_numpy()
    whole = noise + (effect - effect.mean()) / effect.std() * noise.std()
    return nodes.with_columns(pl.Series(name, whole))


def asked(nodes: pl.DataFrame) -> dict[str, omitted_inputs.Dependence]:
    found = omitted_inputs.table(nodes, afloat.PROFILE, np.random.default_rng(7))
    return {row.variable: row for row in found}


def effect(nodes: pl.DataFrame, variable: str) -> np.ndarray:
    """Of an earth-fixed force, a tether, something that wears, a rudder that lags."""
    get = {name: nodes[name].to_numpy() for name in nodes.columns if name != "voyage"}
    if variable == "heading":
        return np.cos(get["heading"] - 0.7)
    if variable == "position":
        north, east = -get["x0"], 5.0 - get["y0"]  # pulled towards (0, 5)
        far = np.hypot(north, east) + 1.0
        return (north * np.cos(get["heading"]) + east * np.sin(get["heading"])) / far
    if variable == "time":
        return get["share"] * get["propeller"] ** 2
    return np.diff(get["rudder_port"], prepend=0.0) * (get["time_s"] > 0.0)


@pytest.mark.parametrize("variable", ["heading", "position", "time", "controls"])
def test_a_planted_dependence_is_found_and_sized(variable):
    nodes = campaign()
    found = asked(planted(nodes, effect(nodes, variable), "sway"))
    assert found[variable].acts_on == ("sway",)
    assert found[variable].r2[1] == max(row.r2[1] for row in found.values())
    if variable in ("heading", "controls"):  # the others are in part visible, or a mean pull
        assert found[variable].r2[1] == pytest.approx(0.5, abs=0.08)
    assert found[variable].folds == "voyages"


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nothing_is_found_where_nothing_is(seed):
    assert not any(row.significant for row in asked(campaign(seed=seed)).values())


def test_what_the_model_sees_is_no_finding():
    """A residual of speed and rudder is the model's own misfit."""
    nodes = campaign()
    observed = nodes["surge"].to_numpy() * nodes["yaw_rate"].to_numpy()
    assert not any(row.significant for row in asked(planted(nodes, observed, "surge")).values())


@pytest.mark.parametrize(("variable", "columns"), [("position", ["x0", "y0"]), ("time", ["share"])])
def test_exchanged_between_voyages_it_vanishes(variable, columns):
    """The negative control: the same forces, the wrong voyage's values."""
    nodes = campaign()
    nodes = planted(nodes, effect(nodes, variable), "surge")
    assert asked(nodes)[variable].significant
    order = np.random.default_rng(5).permutation(5)
    order = np.where(order == np.arange(5), np.roll(order, 1), order)
    moved = np.concatenate([np.arange(NODES) + NODES * v for v in order])
    wrong = nodes.with_columns(nodes.select(columns)[moved.tolist()])
    found = asked(wrong)[variable]
    assert not found.significant
    assert found.r2[0] < 0.05


def test_one_voyage_is_left_out_by_halves_and_that_is_reported():
    nodes = campaign(voyages=1)
    found = asked(planted(nodes, effect(nodes, "heading"), "sway"))
    assert found["heading"].folds == "halves"
    assert found["heading"].acts_on == ("sway",)
    assert not found["time"].significant


def test_many_voyages_are_left_out_in_groups():
    nodes = campaign(voyages=12).filter(pl.col("time_s") < 120.0)
    found = asked(planted(nodes, effect(nodes, "heading"), "sway"))
    assert found["heading"].folds == "groups of voyages"
    assert found["heading"].significant
