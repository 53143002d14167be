"""Whoever imports shiplog keeps the precision and the environment that they have."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

# ν̇ = -k ν straight ahead: Euler's states and their derivatives by k are powers of 1 - k dt.
HOST = """
import os, sys, threading
from dataclasses import dataclass
import jax, jax.numpy as jnp, numpy as np

OURS = {"NPROC", "JAX_COMPILATION_CACHE_DIR", "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"}

def precision():
    return jnp.ones(1).dtype.name, (jnp.arange(3) / 3).dtype.name, jax.config.jax_enable_x64

single = ("float32", "float32", False)
assert precision() == single
import shiplog
shiplog.diagnose  # loads all that it needs
from shiplog.diagnosis.linear import linearisation
from shiplog.simulation import sensitivities
assert precision() == single and not OURS & os.environ.keys()

@jax.tree_util.register_static
@dataclass(frozen=True)
class Coasting:
    names: tuple = ("k",)
    substeps: int = 1
    smooth: float = 0.0
    def acceleration(self, theta, state, actuator, true_wind):
        return -theta[0] * state[..., jnp.array([1, 3, 5])]

seen, over = set(), threading.Event()
def host():
    while not over.is_set():
        seen.add(precision())
other = threading.Thread(target=host)
other.start()
k, n = 0.1 + 1e-9, 20
start = np.zeros((1, n, 6)); start[0, 0, 1] = 1.0
data = sensitivities.WindowSeries(
    start, np.zeros((1, n, 1)), np.zeros((1, n, 2)), np.ones((1, n - 1)), np.ones(1))
states, slopes = sensitivities.linearised(Coasting(), np.array([k]), data)
normal = sensitivities.normal(Coasting(), np.array([k]), data)
along = linearisation.accelerations(
    Coasting(), np.array([k]), start, np.zeros((1, n, 3)))
over.set(); other.join()

i = np.arange(n)
assert np.abs(states[0, :, 1] - (1 - k) ** i).max() < 1e-15
assert np.abs(slopes[0, :, 1, 0] + i * (1 - k) ** (i - 1.0)).max() < 1e-13
assert along[0, 0].tolist() == [-k, 0.0, 0.0]
every = (states, slopes, along, normal.loss, normal.pull, normal.gram)
assert {type(a) for a in every} == {np.ndarray} and {a.dtype.name for a in every} == {"float64"}
assert seen == {single} and precision() == single and not OURS & os.environ.keys()
"""


def test_a_host_in_single_precision_stays_so_while_shiplog_computes_in_double(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", HOST],
        cwd=ROOT,
        env={"PATH": "/usr/bin:/bin", "XDG_CACHE_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("switch", ('"jax_enable_x64"', '"NPROC"'))
def test_what_is_of_the_whole_process_is_set_by_the_command_alone(switch):
    sources = (ROOT / "shiplog").rglob("*.py")
    found = [path.name for path in sources if switch in path.read_text(encoding="utf-8")]
    assert found == (["process.py"] if switch == '"NPROC"' else [])
