"""Functions of the graph against numbers of many digits, and derivatives against differences."""

import math
from fractions import Fraction
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from shiplog.machine.jit_cache import double
from shiplog.simulation.kernel import elementary, machine_code
from shiplog.simulation.kernel.derivatives import gradients
from shiplog.simulation.kernel.from_jaxpr import Reader, UnknownOperation, trace
from shiplog.simulation.kernel.functions import Functions
from shiplog.simulation.kernel.graph import Graph
from shiplog.simulation.kernel.windows import Block
from shiplog.simulation.kernel.writer import INT, POINTER, Module

LEVELS = [one.name for one in machine_code.LEVELS]


def has(name: str) -> bool:
    found = machine_code.level(name)
    return found is not None and found.name == name


@pytest.fixture(params=[pytest.param(n, marks=pytest.mark.skipif(
    not has(n), reason=f"a processor without {n}")) for n in LEVELS])  # fmt: skip
def level(request):
    return machine_code.level(request.param)


def run(function, level, *columns: np.ndarray, derivatives: bool = False) -> np.ndarray:
    """A scalar function of JAX, written as a kernel and called: [n, outputs]."""
    graph, count = Graph(), len(columns)
    x = [graph.varying(i) for i in range(count)]
    closed = trace(lambda x: jnp.atleast_1d(function(*x)), (count,))
    (found,) = Reader(graph).read(closed, [np.array(x, dtype=np.int64)])
    outputs = [int(node) for node in found]
    if derivatives:
        outputs += [node for row in gradients(graph, outputs, x) for node in row]
    plain = Graph()
    flat = elementary.lowered(graph, outputs, plain)
    module = Module(level.lanes)
    functions = Functions(module, plain)
    functions.write("made", flat)
    functions.prepare()
    with module.function("every", [("x", POINTER), ("y", POINTER), ("n", INT)]) as (f, (a, b, n)):
        inside, out, c = f.reserve(count), f.reserve(len(flat)), f.reserve(1)
        f.call("made_fill", c, out)
        with f.loop(n, 0, level.lanes, outer=True) as first:
            block = Block(f, first, n)
            given, to = block.rows(a, count), block.rows(b, len(flat))
            for i in range(count):
                f.store_lanes(given.gathered(i), inside, i)
            f.call("made", inside, c, out)
            to.scattered([f.load_lanes(out, i) for i in range(len(flat))], 0)
    library = machine_code.Library(machine_code.compiled(module.text, level))
    values = np.ascontiguousarray(np.stack(columns, 1), dtype=float)
    found = np.empty((len(values), len(flat)))
    library.function("every", "ppi")(values.ctypes.data, found.ctypes.data, len(values))
    return found


def exact(name: str, *x: float) -> Fraction:
    """By series in fractions, to 40 digits."""
    (a, *_), terms = [Fraction(v) for v in x], 90
    if name == "exp":
        halved = a / 1024
        total = sum(halved**k / math.factorial(k) for k in range(20))
        return total**1024
    turns = round(a / (2 * elementary.PI))
    a -= turns * 2 * elementary.PI
    start = 1 if name == "sin" else 0
    return sum(
        (Fraction((-1) ** k) * a ** (2 * k + start) / math.factorial(2 * k + start))
        for k in range(terms // 2)
    )


@pytest.mark.parametrize("name", ["sin", "cos", "exp"])
def test_functions_of_many_digits(name, level):
    """Within two units of the last place of the result, or 1e-16 of a turn's size near zero."""
    x = np.concatenate((np.linspace(-30.0, 30.0, 41), [1e-9, -0.7853981633974484, 700.0, -700.0]))
    x = x if name == "exp" else np.append(x[:-2], (12345.678, -99999.5))
    found = run(getattr(jnp, name), level, x)[:, 0]
    for value, got in zip(x, found, strict=True):
        wanted = exact(name, value)
        off = abs(Fraction(got) - wanted)
        assert off <= max(2 * Fraction(math.ulp(float(wanted))), Fraction(1, 10**16)), value


PAIRS = {
    "log": (np.log, np.geomspace(1e-300, 1e300, 61)),
    "log1p": (np.log1p, np.concatenate((np.geomspace(1e-18, 1e3, 40), -np.geomspace(1e-18, 0.99)))),
    "expm1": (np.expm1, np.concatenate((np.geomspace(1e-18, 600, 40), -np.geomspace(1e-18, 80)))),
    "tanh": (np.tanh, np.concatenate((np.geomspace(1e-18, 40, 40), -np.geomspace(1e-9, 3)))),
    "sinh": (np.sinh, np.linspace(-20, 20, 41)),
    "cosh": (np.cosh, np.linspace(-20, 20, 41)),
    "tan": (np.tan, np.linspace(-1.5, 1.5, 31)),
    "arcsin": (np.arcsin, np.linspace(-1, 1, 41)),
    "arccos": (np.arccos, np.linspace(-1, 1, 41)),
    "arctan": (np.arctan, np.linspace(-50, 50, 101)),
    "exp2": (np.exp2, np.linspace(-100, 100, 41)),
    "cbrt": (np.cbrt, np.linspace(-10, 10, 41)),
    "sqrt": (np.sqrt, np.geomspace(1e-300, 1e300)),
    "sign": (np.sign, np.array([-2.0, -0.0, 0.0, 3.0])),
    "floor": (np.floor, np.linspace(-3, 3, 25)),
    "ceil": (np.ceil, np.linspace(-3, 3, 25)),
}


@pytest.mark.parametrize("name", PAIRS)
def test_functions_are_those_of_the_c_library(name, level):
    wanted, x = PAIRS[name]
    assert run(getattr(jnp, name), level, x)[:, 0] == pytest.approx(
        wanted(x), rel=2e-15, abs=1e-300
    )


def test_functions_of_two(level):
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 200))
    edge = np.array([0.0, -0.0, 1.0, -1.0, np.inf, -np.inf])
    y, x = np.concatenate((a, np.repeat(edge, 6))), np.concatenate((b, np.tile(edge, 6)))
    assert run(jnp.arctan2, level, y, x)[:, 0] == pytest.approx(np.arctan2(y, x), rel=4e-16)
    powers = np.concatenate((b * 9, np.repeat(np.arange(-3.0, 4.0), 3)))
    bases = np.concatenate((np.abs(a) * 5, np.tile([-2.0, -0.5, 3.0], 7)))
    assert run(jnp.power, level, bases, powers)[:, 0] == pytest.approx(bases**powers, rel=1e-13)
    assert run(jnp.mod, level, y[:200] * 9, np.abs(x[:200]))[:, 0] == pytest.approx(
        np.mod(y[:200] * 9, np.abs(x[:200])), abs=1e-13
    )


@pytest.mark.parametrize("name", ["sin", "cos", "exp", "log", "tanh", "sqrt", "log1p", "expm1"])
def test_what_is_no_number_stays_none_and_edges_are_edges(name, level):
    x = np.array([np.nan, np.inf, -np.inf, 0.0])
    with np.errstate(all="ignore"):
        wanted = getattr(np, name)(x)
    found = run(getattr(jnp, name), level, x)[:, 0]
    if name in ("sin", "cos"):
        assert np.isnan(found[:3]).all() and found[3] == wanted[3]
    else:
        assert np.array_equal(found, wanted, equal_nan=True)


def test_not_a_number_goes_through_what_chooses(level):
    one, other = np.array([np.nan, 1.0, np.nan, 2.0]), np.array([1.0, np.nan, np.nan, 1.0])
    for function in (jnp.maximum, jnp.minimum, lambda x, y: jnp.clip(x, -1.0, 1.5) + y):
        assert np.isnan(run(function, level, one, other)[:3, 0]).all()
    assert run(jnp.maximum, level, one, other)[3, 0] == 2.0


CURVES = {
    "circle": lambda x, y: jnp.arctan2(y, x) + jnp.sin(x) * jnp.cos(y),
    "growth": lambda x, y: jnp.exp(x) * jnp.log(2.0 + y * y) + jnp.log1p(y * y) + jnp.expm1(x),
    "root": lambda x, y: jnp.sqrt(1.0 + x * x) / (2.0 + jnp.tanh(y)) + jax.nn.sigmoid(x - y),
    "powers": lambda x, y: (1.5 + x * x) ** y + x**3 + (2.0 + jnp.sin(y)) ** -2 + jnp.cbrt(y),
    "angles": lambda x, y: jnp.arcsin(0.3 * jnp.sin(x)) + jnp.arccos(0.2 * y) + jnp.tan(0.2 * x),
    "hyperbolic": lambda x, y: jnp.sinh(x) * jnp.cosh(y) + jnp.exp2(x),
    "corners": lambda x, y: jnp.abs(x) * jnp.maximum(x, y) + jnp.minimum(x * y, 0.3) - jnp.sign(y),
    "choice": lambda x, y: jnp.where(x > y, x * x, y) + jnp.where((x > 0) & ~(y > 0), x, -y),
    "sums": lambda x, y: (
        jnp.cumsum(jnp.stack((x, y, x * y)))[::-1].prod() + jnp.stack((x, y)).max()
    ),
    "matrix": lambda x, y: (
        (jnp.array([[1.0, 2.0], [0.5, -1.0]]) @ jnp.stack((x, y)))
        @ jnp.tile(jnp.stack((x, y * y)), 2)[jnp.array([1, 2])]
    ),
    "moved": lambda x, y: (
        jnp.zeros(4).at[jnp.array([2, 0])].set(jnp.stack((x, y)))
        @ jnp.pad(jnp.stack((x * y, y)), (1, 1), constant_values=2.0)
    ),
    "loop": lambda x, y: (
        jax.lax.fori_loop(0, 4, lambda i, a: 0.5 * a + jnp.sin(a), x)
        + jax.lax.scan(lambda a, b: (a * y + b, a), x, jnp.array([1.0, -0.5, 0.2]))[0]
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CURVES)
def test_values_and_derivatives_are_jaxs(name, level):
    function = CURVES[name]
    x, y = np.random.default_rng(1).normal(size=(2, 37))
    found = run(function, level, x, y, derivatives=True)
    with double():
        value = jax.vmap(function)(x, y)
        slopes = jax.vmap(jax.grad(function, (0, 1)))(x, y)
    assert found[:, 0] == pytest.approx(np.asarray(value), rel=1e-12, abs=1e-14)
    for i in (0, 1):
        assert found[:, 1 + i] == pytest.approx(np.asarray(slopes[i]), rel=1e-10, abs=1e-12)


CORNERS = {
    "abs": jnp.abs, "of a square": lambda x: jnp.abs(x) * x, "cube": lambda x: jnp.abs(x) ** 3,
    "max": lambda x: jnp.maximum(x, 0.0), "min": lambda x: jnp.minimum(0.0, x),
    "clip": lambda x: jnp.clip(x, 0.0, 1.0), "clamp": lambda x: jax.lax.clamp(-1.0, x, 0.0),
    "sign": lambda x: jnp.sign(x) * (1.0 + x),
    "root": lambda x: jnp.sqrt(jnp.maximum(x * x, 1e-12)),
    "where": lambda x: jnp.where(x > 0.0, 2.0 * x, x),
    "array": lambda x: jnp.stack((x, 0.0 * x)).max(), "power": lambda x: (x * x) ** 1.5,
}  # fmt: skip


@pytest.mark.parametrize("name", CORNERS)
def test_a_corner_has_jaxs_derivative(name):
    """A ship at rest is on many of them."""
    x = np.array([0.0, -0.0, 1.0, -1.0])
    found = run(CORNERS[name], machine_code.level(), x, derivatives=True)
    with double():
        assert np.array_equal(found[:, 0], jax.vmap(CORNERS[name])(x))
        assert np.array_equal(found[:, 1], jax.vmap(jax.grad(CORNERS[name]))(x))


def test_derivatives_are_differences():
    """Without JAX in it."""
    function, h = CURVES["circle"], 1e-6
    x, y = np.random.default_rng(2).normal(size=(2, 20))
    at = machine_code.level()
    found = run(function, at, x, y, derivatives=True)[:, 1]
    up, down = (run(function, at, x + s, y)[:, 0] for s in (h, -h))
    assert found == pytest.approx((up - down) / (2 * h), abs=1e-8)


@pytest.mark.parametrize(
    ("function", "name"),
    [
        (lambda x: jax.scipy.special.erf(x), "erf"),
        (lambda x: jnp.sort(jnp.stack((x, -x)))[0], "sort"),
        (lambda x: jax.lax.while_loop(lambda a: a < 3.0, lambda a: a + 1.0, x), "while"),
        (lambda x: x.astype(jnp.float32).astype(float), "float32"),
        (jax.nn.relu, "a derivative of its own"),
        (lambda x: jnp.fft.fft(jnp.stack((x, x))).real[0], "complex128"),
    ],
)
def test_an_operation_that_is_not_known_is_named(function, name):
    graph = Graph()
    with pytest.raises(UnknownOperation, match=name):
        Reader(graph).read(trace(function, ()), [np.array(graph.varying(0))])


def test_equal_operations_are_one_and_what_is_known_is_computed():
    g = Graph()
    x, two = g.varying(0), g.const(2.0)
    assert g.mul(x, two) == g.mul(two, x) and g.add(x, g.const(0.0)) == x
    assert g.value(g.add(g.mul(two, two), g.const(1.0))) == 5.0
    assert g.value(g.mul(x, g.const(0.0))) == 0.0
    assert g.const(0.0) != g.const(-0.0)
    fixed = g.fixed(0)
    assert not g.varies[g.mul(fixed, two)] and g.varies[g.mul(fixed, x)]


def test_a_level_that_nobody_knows_is_the_processors_and_off_is_none(monkeypatch):
    assert machine_code.level("avx1024") == machine_code.level("avx512") == machine_code.level()
    assert machine_code.level("off") is None
    lacking = SimpleNamespace(get_host_cpu_features=lambda: {"avx2": True, "fma": True, "bmi2": 1})
    monkeypatch.setattr(machine_code, "_llvm", lambda: lacking)
    machine_code.level.cache_clear()
    assert [machine_code.level(n).name for n in ("avx512", "avx2", "portable")] == [
        "avx2", "avx2", "portable",
    ]  # fmt: skip
    machine_code.level.cache_clear()


def test_without_llvm_jax_runs_the_models_and_that_is_said(monkeypatch, caplog):
    def missing():
        raise ImportError("no llvmlite")

    monkeypatch.setattr(machine_code, "_llvm", missing)
    machine_code.level.cache_clear()
    assert machine_code.level() is None and "no llvmlite" in caplog.text
    machine_code.level.cache_clear()
