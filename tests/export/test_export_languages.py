"""Operations in C, numpy and Octave against JAX, at ordinary numbers and where they end."""

import math

import jax.numpy as jnp
import numpy as np
import pytest

from shiplog.export import compilers, mss, statements
from shiplog.export.equations import LEAST_PRODUCT, Equations, of_model
from shiplog.export.filled import replaced
from shiplog.export.languages import OCTAVE, PYTHON, C
from shiplog.machine.jit_cache import double

MATRIX = np.random.default_rng(0).normal(size=(40, 30))
PLACES = np.linspace(0.0, 1.0, 30)
assert MATRIX.size > LEAST_PRODUCT
HARD = [
    0.0,
    -0.0,
    0.5,
    -0.5,
    1.5,
    2.5,
    -2.5,
    1.0,
    -1.0,
    3.7,
    -40.0,
    800.0,
    math.inf,
    -math.inf,
    math.nan,
]


class Everything:
    """ν̇ of functions that a cause of the user's own may have, by two arguments and a number."""

    def acceleration(self, theta, state, actuator, wind):
        x, y = state[1], state[3]
        one = jnp.where(x > y, jnp.maximum(x, y), jnp.minimum(x, y)) + jnp.sign(x) * jnp.abs(y)
        one = one + jnp.where((x == y) | ~(x < 2.0) & (y >= -1.0), jnp.floor(x), jnp.ceil(y))
        two = jnp.sqrt(x**2 + 2.0) + jnp.cbrt(y) + jnp.power(x, 3) + jnp.sqrt(y)
        two = two + jnp.where(jnp.isfinite(x), 1.0, 2.0) + jnp.clip(x, -0.7, theta[0])
        ring = jnp.sin(x) * jnp.cos(y) + jnp.tan(0.1 * x) + jnp.arctan2(y, x) + jnp.exp(-(y**2))
        three = ring + jnp.tanh(x) + jnp.log1p(jnp.abs(x)) + jnp.log(1.0 + jnp.exp(0.1 * y))
        many = jnp.tanh(jnp.asarray(MATRIX) @ jnp.sin(jnp.asarray(PLACES) * x))
        return jnp.stack((one, two, three + 0.01 * many.sum() + jnp.mod(x, 2.0 * jnp.pi)))


@pytest.fixture(scope="module")
def cases() -> tuple[Equations, np.ndarray, np.ndarray]:
    """Equations, inputs [n, 2] and what JAX says of them [n, 3]."""
    x = np.array([(a, b) for a in HARD for b in HARD])
    with double():
        wanted = [
            Everything().acceleration(
                jnp.array([0.9]), jnp.array([0.0, a, 0.0, b, 0.0, 0.0]), jnp.zeros(0), jnp.zeros(2)
            )
            for a, b in x
        ]
    return of_model(Everything(), 1, 0, share=False), x, np.array(wanted)


def same(found: np.ndarray, wanted: np.ndarray) -> None:
    assert np.array_equal(np.isnan(found), np.isnan(wanted))
    there = ~np.isnan(wanted)
    assert found[there] == pytest.approx(wanted[there], rel=1e-12, abs=1e-13)


def rows(x: np.ndarray) -> np.ndarray:
    """[n, 8]: the state and the wind."""
    whole = np.zeros((len(x), 8))
    whole[:, [1, 3]] = x
    return whole


@pytest.mark.long
def test_numpy_says_what_jax_says(cases):
    equations, x, wanted = cases
    made = statements.written(equations, PYTHON, lambda name, m, n, given: [
        f"{name} = MATRIX @ stack(broadcast_arrays({', '.join(given)}))"
    ])  # fmt: skip
    known = {n: getattr(np, n) for n in dir(np)} | {"p": [0.9], "c": [0.0] * made.constants}
    known |= {"MATRIX": equations.matrices[0], "x": rows(x).T}
    with np.errstate(all="ignore"):
        exec("\n".join((*made.hoisted, *made.varying)), known)
        found = [np.broadcast_to(eval(one, known), len(x)) for one in made.outputs]
    same(np.stack(found, 1), wanted)


class Turned:
    """Sines and cosines of sums with an angle of two components."""

    def acceleration(self, theta, state, actuator, wind):
        x, y, a = state[1], state[3], state[4]
        t = jnp.arctan2(y, x)
        sums = (jnp.sin(a + t) + 2.0 * jnp.cos(t + a), jnp.sin(a - t) + 3.0 * jnp.cos(t - a))
        return jnp.stack((*sums, jnp.sin(t) - 5.0 * jnp.cos(a - t)))


def test_an_angle_of_two_components_needs_no_angle():
    """Against JAX, which has it: also where there is no direction."""
    made = statements.written(of_model(Turned(), 0, 0, share=False), PYTHON, lambda *_: [])
    code = "\n".join((*made.hoisted, *made.varying))
    assert "arctan2" not in code + "".join(made.outputs)
    values = [0.0, -0.0, 1e-160, 0.5, -0.5, -1.0, 3.7, -40.0, 1e120]
    x = np.array([(a, b, c) for a in values for b in values for c in (0.0, 0.3, -2.0, 9.0)])
    x = x[~((np.abs(x[:, :2]).max(1) < 1e-140) & (np.abs(x[:, :2]).max(1) > 0.0))]
    x = x[~(np.signbit(x[:, 0]) & (x[:, :2] == 0.0).all(1))]  # atan2(0, -0) is a half turn
    whole = np.zeros((8, len(x)))
    whole[[1, 3, 4]] = x.T
    known = {n: getattr(np, n) for n in dir(np)} | {"c": [], "x": whole}
    exec(code, known)
    found = np.stack([np.broadcast_to(eval(one, known), len(x)) for one in made.outputs], 1)
    with double():
        wanted = [Turned().acceleration(None, jnp.array(one), None, None) for one in whole.T]
    assert found == pytest.approx(np.array(wanted), abs=1e-12)


@pytest.mark.long
@pytest.mark.skipif(compilers.own() is None, reason="no C compiler is installed")
def test_c_says_what_jax_says(cases, tmp_path):
    equations, x, wanted = cases
    made = statements.written(equations, C, lambda name, m, n, given: [
        f"double {name}_of[] = {{{', '.join(given)}}}, {name}[{n}];",
        f"for (int i = 0; i < {n}; ++i) {{ {name}[i] = 0.0; for (int j = 0; j < {len(given)}; ++j)"
        f" {name}[i] += MATRIX[i][j] * {name}_of[j]; }}",
    ])  # fmt: skip
    matrix = ", ".join(
        "{" + ", ".join(map(repr, row)) + "}" for row in equations.matrices[0].tolist()
    )
    size = equations.matrices[0].shape
    program = f"""
#include <math.h>
#include <stdio.h>
static double s_larger(double a, double b) {{ return a > b || a != a ? a : b; }}
static double s_smaller(double a, double b) {{ return a < b || a != a ? a : b; }}
static const double MATRIX[{size[0]}][{size[1]}] = {{{matrix}}};
int main(void) {{
    double x[8], turn[2], c[{made.constants + 1}];
    const double p[] = {{0.9}};
    {" ".join(made.hoisted)}
    while (fread(x, 8, 8, stdin) == 8) {{
        {" ".join(made.varying)}
        double out[] = {{{", ".join(made.outputs)}}};
        fwrite(out, 8, 3, stdout);
    }}
    (void)p; (void)turn;
    return 0;
}}
"""
    (tmp_path / "main.c").write_text(replaced(program, {"NAME": "s"}))
    compiler = compilers.own()
    assert compiler is not None
    compilers.run([compiler, "-std=c99", "-O2", "-o", "main", "main.c", "-lm"], tmp_path)
    said = compilers.run([str(tmp_path / "main")], tmp_path, rows(x).tobytes())
    same(np.frombuffer(said).reshape(-1, 3), wanted)


@pytest.mark.long
@pytest.mark.skipif(mss.octave() is None, reason="Octave is not installed")
def test_octave_says_what_jax_says(cases, tmp_path):
    equations, x, wanted = cases
    made = statements.written(equations, OCTAVE, lambda name, m, n, given: [
        f"{name} = MATRIX * [{'; '.join(given)}];"
    ])  # fmt: skip
    template = (compilers.Path(mss.__file__).parent / "templates" / "ship_m.txt").read_text()
    helpers = template[template.index("function y = larger") :]
    (tmp_path / "rates.m").write_text(
        "function out = rates(x, MATRIX)\np = 0.9; c = zeros(100, 1);\n"
        + "\n".join((*made.hoisted, *made.varying))
        + f"\nout = [{'; '.join(made.outputs)}];\nend\n\n{helpers}"
    )
    (tmp_path / "given.bin").write_bytes(rows(x).tobytes())
    (tmp_path / "matrix.bin").write_bytes(equations.matrices[0].tobytes("F"))
    shape = "{}, {}".format(*equations.matrices[0].shape)
    (tmp_path / "drive.m").write_text(
        "f = fopen('given.bin'); x = reshape(fread(f, Inf, 'double'), 8, []); fclose(f);\n"
        f"f = fopen('matrix.bin'); M = reshape(fread(f, Inf, 'double'), {shape}); fclose(f);\n"
        "out = zeros(3, columns(x)); for k = 1:columns(x), out(:, k) = rates(x(:, k), M); end\n"
        "f = fopen('found.bin', 'w'); fwrite(f, out, 'double'); fclose(f);\n"
    )
    octave = mss.octave()
    assert octave is not None
    compilers.run([octave, "--norc", "--quiet", "drive.m"], tmp_path)
    same(np.frombuffer((tmp_path / "found.bin").read_bytes()).reshape(-1, 3), wanted)
