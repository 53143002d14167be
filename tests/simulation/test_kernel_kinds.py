"""The kernel of a kind of ship against JAX and against differences, over ships, causes and models
of the user's own; and what becomes of a kernel that cannot be made, read or kept."""

import logging
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import ClassVar

import hybrid_ship
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cause_ships import FERRY, SINGLE, TWIN, extended, network, sized

from shiplog.diagnosis.linear import jax_paths
from shiplog.machine.jit_cache import double
from shiplog.models import hybrid, mmg
from shiplog.models.causes import CATALOGUE
from shiplog.models.causes.base import Cause, Parameter
from shiplog.ship_profile import file as profiles
from shiplog.simulation import jax_rollouts, sensitivities
from shiplog.simulation.kernel import kinds, machine_code, paths, rollouts
from shiplog.simulation.window_series import WindowSeries

SHIPS = ("blueboat", "esso-osaka", "esso-vectwin", "kvlcc2", "milliampere")


def sailing(actuators: int, count: int = 5, size: int = 12) -> WindowSeries:
    """Windows of a ship of three metres under way, in all quarters; azimuths, rudders and
    revolutions alike go from -1 to 1, and the last one is positive."""
    rng = np.random.default_rng(7)
    state = np.zeros((count, size, 6))
    low, high = (-20, 0.1, -20, -0.2, -3, -0.1), (20, 0.9, 20, 0.2, 3, 0.1)
    state[:, 0] = rng.uniform(low, high, (count, 6))
    driven = rng.uniform(-1.0, 1.0, (count, 1, actuators)) + 0.1 * rng.normal(
        size=(count, size, actuators)
    )
    driven[..., -1] = np.abs(driven[..., -1])
    wind = rng.uniform(-3.0, 3.0, (count, 1, 2)) + np.zeros((1, size, 1))
    dt = rng.uniform(0.4, 0.6, (count, size - 1))
    return WindowSeries(state, driven, wind, dt, rng.uniform(0.0, 2.0, count))


@dataclass(frozen=True)
class Sail(Cause):
    """A cause as a user writes one, with functions that no other cause has."""

    name: ClassVar = "sail"
    kind: ClassVar = "ship"
    story: ClassVar = "A sail is set."
    equation: ClassVar = "X = {area:.1f} m² …"
    parameters: ClassVar = (Parameter("area", "m²", 1.0, 0.1), Parameter("lead", "m", 0.5, 0.1))

    def force(self, p, state, at):
        u, r = state[..., 1], state[..., 5]
        pull = p[0] * jnp.tanh(u) ** 3 * jnp.exp(-jnp.abs(r)) * jnp.log1p(u**2)
        side = pull * jax.nn.sigmoid(u) * jnp.arcsin(0.5 * jnp.cos(state[..., 4]))
        return jnp.stack((pull, side, p[1] * side), -1)


def physics(name: str):
    profile = profiles.load(name)
    ship, main, _ = mmg.geometry_of(profile)
    return mmg.MMG(ship), mmg.estimated(ship, main).values, len(profile.actuators)


def with_causes(profile, causes, base=None):
    model, values = extended(causes, profile, base=base)
    numbers = [np.full(2, 0.3) if c.name == "sail" else sized(c) for c in causes]
    return model, np.concatenate((values, *numbers)), len(profile.actuators) + 1


def hybrid_model():
    residual = hybrid.Residual(
        width=3, mean=np.zeros(7), std=np.ones(7), bound=np.full(3, 0.1),
        anchors=np.random.default_rng(0).normal(size=(9, 7)), radius=0.5, limit=1.0,
    )  # fmt: skip
    weights = hybrid.first_weights(residual, np.random.default_rng(1)) + 0.1
    model = hybrid.Hybrid(hybrid_ship.PHYSICS, residual)
    return model, np.concatenate((hybrid_ship.THETA, weights)), 2


# It has neither rudder nor, in its profile, a wall
OF_THE_FERRY = [
    c for c in CATALOGUE if "rudder" not in c.label and c.name not in ("bank", "contact")
]
MODELS = {
    **{name: lambda name=name: physics(name) for name in SHIPS},
    "two rudders, all causes": lambda: with_causes(TWIN, CATALOGUE),
    "a ferry, its causes": lambda: with_causes(FERRY, OF_THE_FERRY),
    "a user's cause": lambda: with_causes(SINGLE, (Sail(),)),
    "a small network, causes": lambda: with_causes(TWIN, CATALOGUE[:4], network()),
    "hybrid": hybrid_model,
}


# What JAX needs to compile them all is CI's.
QUICK, ALL_CAUSES = ("blueboat", "a user's cause"), "two rudders, all causes"


@pytest.fixture(
    scope="module",
    params=[pytest.param(n, marks=[] if n in QUICK else pytest.mark.long) for n in MODELS],
)
def sailed(request):
    model, theta, actuators = MODELS[request.param]()
    return model, theta, sailing(actuators)


def close(found, wanted, digits: float, rounding: float = 0.0) -> None:
    """To so much of the largest of its kind, and to the rounding of what `wanted` was worked out
    from; not finite at the same places."""
    wanted = np.asarray(wanted)
    finite = np.isfinite(wanted)
    assert np.array_equal(np.isfinite(found), finite) and finite.mean() > 0.5
    axes = tuple(range(wanted.ndim - 1))
    size = np.abs(np.where(finite, wanted, 0.0)).max(axes, keepdims=True)
    off = np.abs(np.where(finite, found - np.where(finite, wanted, 0.0), 0.0))
    assert (off <= digits * np.maximum(size, 1e-3 * size.max()) + rounding).all()


def test_accelerations_and_rollouts_are_jaxs(sailed):
    model, theta, data = sailed
    inputs = np.concatenate((data.measured[:, 0], data.actuator[:, 0], data.wind[:, 0]), 1)
    cut = inputs.shape[1] - 2
    with double():
        wanted = model.acceleration(
            jnp.asarray(theta), inputs[:, :6], inputs[:, 6:cut], inputs[:, cut:]
        )
    close(rollouts.values(model, theta, inputs), wanted, 1e-12)
    close(
        sensitivities.rollout(model, theta, data), jax_rollouts.rollout(model, theta, data), 1e-11
    )


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n in QUICK else pytest.mark.long) for n in MODELS]
)
def test_derivatives_are_jaxs(name):
    model, theta, actuators = MODELS[name]()
    data = sailing(actuators)
    states, slopes = sensitivities.linearised(model, theta, data)
    wanted, by_theta = jax_rollouts.linearised(model, theta, data)
    close(states, wanted, 1e-11)
    close(slopes, by_theta, 1e-10)
    found, normal = (m.normal(model, theta, data) for m in (sensitivities, jax_rollouts))
    for one, other in zip((found.loss, found.pull), (normal.loss, normal.pull), strict=True):
        close(one, other, 1e-10)
    size = np.sqrt(np.outer(np.diag(normal.gram), np.diag(normal.gram)))
    assert (np.abs(found.gram - normal.gram) <= 1e-10 * np.maximum(size, 1e-300)).all()


def test_a_ship_at_rest_has_jaxs_derivatives():
    """Nothing moves, nothing is commanded, there is no wind: each |x| is at its corner."""
    model, theta, actuators = MODELS["blueboat"]()
    rest = WindowSeries(
        *(np.zeros_like(values) for values in sailing(actuators)[:3]), *sailing(1)[3:]
    )
    found = sensitivities.linearised(model, theta, rest)
    for one, wanted in zip(found, jax_rollouts.linearised(model, theta, rest), strict=True):
        assert one == pytest.approx(wanted, rel=1e-10, abs=1e-14)


@pytest.mark.parametrize("name", ["kvlcc2", "two rudders, all causes", "a user's cause"])
def test_derivatives_are_differences(name):
    """Of rollouts, without JAX: central, of each of some coefficients."""
    model, theta, actuators = MODELS[name]()
    data = sailing(actuators)
    _, slopes = sensitivities.linearised(model, theta, data)
    for i in np.random.default_rng(0).choice(len(theta), 12, replace=False):
        h = 1e-6 * max(abs(theta[i]), 1e-2)
        up, down = (
            sensitivities.rollout(model, theta + s * h * np.eye(len(theta))[i], data)
            for s in (1.0, -1.0)
        )
        # ε |x| of each rollout, whose steps add up to a few of them
        rounding = 4.0 * np.finfo(float).eps * np.nanmax(np.abs(up)) / h
        close(slopes[..., i], (up - down) / (2.0 * h), 2e-5, rounding)


def segments(actuators: int, nodes: int = 4, bins: int = 3, per: int = 4):
    rng = np.random.default_rng(3)
    data = sailing(actuators, count=11, size=bins * per + 1)
    at = np.arange(bins * per + 1) / (bins * per) * (nodes - 1)
    hats = np.maximum(1.0 - np.abs(at[:, None] - np.arange(nodes)), 0.0)
    driven = np.concatenate((data.actuator, data.wind), -1)
    acceleration = 0.01 * rng.normal(size=(11, nodes, 3))
    return data.measured[:, 0], np.einsum("kj,sjc->skc", hats, acceleration), driven, hats


@pytest.mark.parametrize("name", ["blueboat", pytest.param(ALL_CAUSES, marks=pytest.mark.long)])
def test_columns_of_segments_are_jaxs(name):
    """By start, nodes and θ along random directions, also by what numbers move of the inputs."""
    model, theta, actuators = MODELS[name]()
    start, acceleration, driven, hats = segments(actuators)
    pairs = np.array([[0, 1], [0, 4], [2, 0], [actuators + 1, 2]])
    series = np.random.default_rng(4).normal(size=(11, 4, len(hats)))
    step, bins, count = 0.5, 3, 5
    y, z, j = paths.columns(
        model, theta, start, acceleration, driven, hats, step, bins, (pairs, series, count)
    )

    def means(begin, pushed, numbers, given):
        moved, added, along = given
        for n, (d, q) in enumerate(pairs):
            place = len(theta) - count + q
            moved = moved.at[:, d].add((numbers[place] - theta[place]) * along[n])
        at = jax_paths.states_along(
            model, numbers, begin[None], (added + hats @ pushed)[None], moved[None], step
        )[0]
        return (0.5 * (at[1:] + at[:-1])).reshape(bins, -1, 6).mean(1)

    @jax.jit
    def along(at, direction, given):
        return jax.jvp(lambda *one: means(*one, given), at, direction)

    rng = np.random.default_rng(5)
    with double():
        for s in (0, 7, 10):
            at = start[s], np.zeros((hats.shape[1], 3)), theta
            direction = tuple(rng.normal(size=values.shape) for values in at)
            value, slope = along(at, direction, (driven[s], acceleration[s], series[s]))
            by_start, by_nodes, by_theta = direction
            columns = np.concatenate((z[s], j[s]), -1)
            whole = np.concatenate((by_start, by_nodes.T.ravel(), by_theta))
            close(y[s], value, 1e-12)
            size = np.abs(columns) @ np.abs(whole)
            assert (np.abs(columns @ whole - np.asarray(slope)) <= 1e-12 * size).all()
    alone, without, nothing = paths.columns(
        model, theta, start, acceleration, driven, hats, step, bins
    )
    # two compiled functions round differently in the last bit
    assert alone == pytest.approx(y, rel=1e-14, abs=1e-15)
    assert without == pytest.approx(z, rel=1e-13, abs=1e-14)
    assert nothing is None


def test_a_window_is_what_it_is_whoever_stands_next_to_it():
    """Lanes do not mix: one by one, or all at once, to the last bit."""
    model, theta, actuators = MODELS["esso-osaka"]()
    data = sailing(actuators, count=21)
    whole = sensitivities.linearised(model, theta, data)
    for i in (0, 8, 20):
        one = WindowSeries(*(values[i : i + 1] for values in data))
        alone = sensitivities.linearised(model, theta, one)
        assert all(np.array_equal(a[0], w[i]) for a, w in zip(alone, whole, strict=True))


def test_threads_change_no_bit():
    """Nor does it matter which of them is the first to ask for a kernel."""
    model, theta, actuators = MODELS["esso-osaka"]()
    data = sailing(actuators, count=21)
    wanted = sensitivities.normal(model, theta, data)
    kinds._known.clear()
    with ThreadPoolExecutor(4) as threads:
        each = threads.map(lambda _: sensitivities.normal(model, theta, data), range(12))
        for found in each:
            assert np.array_equal(found.gram, wanted.gram)
            assert np.array_equal(found.pull, wanted.pull)


def test_memory_of_an_earlier_call_is_used_again_and_no_other():
    model, theta, actuators = MODELS["esso-osaka"]()
    data = sailing(actuators)
    first = sensitivities.linearised(model, 1.1 * theta, data)
    wanted = sensitivities.linearised(model, theta, data)
    found = sensitivities.linearised(model, theta, data, out=first)
    assert all(a is b for a, b in zip(found, first, strict=True))
    assert all(np.array_equal(a, b) for a, b in zip(found, wanted, strict=True))
    plain = tuple(np.array(values) for values in wanted)
    for bad in (plain, (wanted[0], wanted[1][:-1]), (wanted[0].astype("f4"), wanted[1])):
        with pytest.raises(ValueError, match="earlier call"):
            sensitivities.linearised(model, theta, data, out=bad)


def test_arrays_that_do_not_fit_together_are_refused():
    """What is read is never what stands behind an array."""
    model, theta, actuators = MODELS["blueboat"]()
    data = sailing(actuators)
    for name in ("actuator", "wind", "dt", "weight"):
        short = data._replace(**{name: getattr(data, name)[:-1]})
        with pytest.raises(ValueError, match="shape"):
            sensitivities.normal(model, theta, short)
    with pytest.raises(ValueError, match="free"):
        sensitivities.normal(model, theta, data, (0, len(theta)))
    start, acceleration, driven, hats = segments(actuators)
    for pairs in ([[0, 2]], [[actuators + 2, 0]], [[-1, 0]]):
        moved = np.array(pairs), np.zeros((11, 1, len(hats))), 2
        with pytest.raises(ValueError, match="pairs"):
            paths.columns(model, theta, start, acceleration, driven, hats, 0.5, 3, moved)
    with pytest.raises(ValueError, match="shape"):
        paths.columns(model, theta, start[:-1], acceleration, driven, hats, 0.5, 3)


def test_levels_agree(monkeypatch):
    model, theta, actuators = MODELS["esso-osaka"]()
    data = sailing(actuators)
    found = []
    for one in machine_code.LEVELS:
        level = machine_code.level(one.name)
        monkeypatch.setattr(machine_code, "level", lambda wanted=None, level=level: level)
        found.append(sensitivities.normal(model, theta, data).gram)
    assert len(found) > 1
    for other in found[1:]:
        close(other, found[0], 1e-11)


# --- kernels that cannot be made, read or kept


@jax.tree_util.register_static
@dataclass(frozen=True)
class Sorted:
    """An operation that no kernel knows."""

    substeps: int = 1
    names: ClassVar = ("k",)

    def acceleration(self, theta, state, actuator, true_wind):
        return -theta[0] * jnp.sort(state[..., jnp.array([1, 3, 5])], axis=-1)


def test_an_unknown_operation_is_jaxs_and_said_once(caplog):
    data, theta = sailing(1), np.array([0.1])
    with caplog.at_level(logging.INFO):
        for _ in range(2):
            found = sensitivities.rollout(Sorted(), theta, data)
    assert np.array_equal(found, jax_rollouts.rollout(Sorted(), theta, data))
    said = [r.getMessage() for r in caplog.records if "no kernel" in r.getMessage()]
    assert said == ["JAX runs the model Sorted: no kernel is made of sort."]


@pytest.fixture
def fresh(tmp_path, monkeypatch):
    """A cache of its own, and nothing known yet; a ship, and how to run it."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    model, theta, actuators = MODELS["esso-osaka"]()
    data = sailing(actuators)

    def run():
        kinds._known.clear()
        return sensitivities.rollout(model, theta, data)

    yield tmp_path / "shiplog" / "kernels", run
    kinds._known.clear()


def test_a_kernel_that_is_kept_is_used_and_one_that_is_damaged_is_made_again(fresh, monkeypatch):
    folder, run = fresh
    first = run()
    (kept,) = folder.iterdir()
    good = kept.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(kinds, "written", None)  # what is kept needs no second look at the equations
        assert np.array_equal(run(), first)
    flipped = bytearray(good)
    flipped[-100] ^= 1
    for bad in (
        good[:-50],
        bytes(flipped),
        b"",
        b"{}\n",
        b"no JSON\n\0",
        b"[1]\n",
        b'{"key": 1}\n',
    ):
        kept.write_bytes(bad)
        assert np.array_equal(run(), first)
        assert kept.read_bytes() == good


def test_a_kernel_of_another_processor_or_version_is_not_used(fresh, monkeypatch):
    folder, run = fresh
    run()
    level = machine_code.level()
    assert level is not None
    other = replace(level, name="another")
    monkeypatch.setattr(machine_code, "level", lambda wanted=None: other)
    run()
    monkeypatch.setattr(machine_code.disk_cache, "source", lambda: b"another version")
    run()
    assert len(list(folder.iterdir())) == 3


def test_a_full_disk_is_said_and_the_kernel_is_used(fresh, monkeypatch, caplog):
    folder, run = fresh
    first = run()
    (kept,) = folder.iterdir()
    kept.unlink()

    def full(path):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(machine_code.files, "whole", full)
    with caplog.at_level(logging.WARNING):
        assert np.array_equal(run(), first)
    assert "No space left on device" in caplog.text and not list(folder.iterdir())
