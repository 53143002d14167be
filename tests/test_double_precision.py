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
from pathlib import Path
import jax, jax.numpy as jnp, numpy as np

def settings():
    return {name: jax.config._read(name) for name in jax.config.values}

OTHERS = ("_RJEM_MALLOC_CONF", "KMP_DUPLICATE_LIB_OK")  # of polars, of threadpoolctl

def variables():
    return {name: value for name, value in os.environ.items() if name not in OTHERS}

environment, before = variables(), settings()
def precision():
    return jnp.ones(1).dtype.name, (jnp.arange(3) / 3).dtype.name, jax.config.jax_enable_x64

single = ("float32", "float32", False)
assert precision() == single
import shiplog
shiplog.diagnose  # loads all that it needs
from shiplog.diagnosis.linear import linearisation
from shiplog.simulation import window_series, sensitivities
assert precision() == single and (variables(), settings()) == (environment, before)

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
data = window_series.WindowSeries(
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
assert seen == {single} and precision() == single
assert (variables(), settings()) == (environment, before)
jax.jit(lambda x: 3 * x)(jnp.ones(2)).block_until_ready()  # the host's own is not shiplog's to keep
print(len(compiled := list(Path(os.environ["XDG_CACHE_HOME"]).rglob("jax/*-cache"))))
assert not [path for path in compiled if "lambda" in path.name], compiled
"""


def hosted(folder, program=HOST, **variables):
    """What a program printed that imports shiplog, with an empty environment and this cache."""
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        env={"PATH": "/usr/bin:/bin", "XDG_CACHE_HOME": str(folder), **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.nightly
def test_a_host_in_single_precision_stays_so_while_shiplog_computes_in_double(tmp_path):
    """And what shiplog compiles, but not what its host does, is kept for the next process."""
    by_jax = {"SHIPLOG_KERNEL": "off"}
    hosted(tmp_path)  # by kernels
    first, again = hosted(tmp_path, **by_jax), hosted(tmp_path, **by_jax)
    assert int(first) >= 3  # functions: rollouts with derivatives, normal equations, accelerations
    assert again == first


def test_a_host_with_a_folder_of_its_own_for_compiled_functions_keeps_it(tmp_path):
    own = {"JAX_COMPILATION_CACHE_DIR": str(tmp_path / "own")}
    own |= {"JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0", "SHIPLOG_KERNEL": "off"}
    assert int(hosted(tmp_path, **own)) == 0
    assert len(list((tmp_path / "own").glob("*-cache"))) >= 3


BEFORE_JAX = """
import os, sys
import shiplog
assert "jax" not in sys.modules
shiplog.open_store
changed = {n for n in os.environ if n.startswith(("JAX", "XLA", "OMP", "OPENBLAS", "NPROC"))}
import jax
assert not changed and jax.config.jax_compilation_cache_dir is None
assert jax.config.jax_persistent_cache_min_compile_time_secs == 1.0  # JAX's own
"""


def test_a_host_that_imports_jax_later_finds_jaxs_own_settings(tmp_path):
    hosted(tmp_path, BEFORE_JAX)


@pytest.mark.parametrize("switch", ('"jax_enable_x64"', '"NPROC"'))
def test_what_is_of_the_whole_process_is_set_by_the_command_alone(switch):
    sources = (ROOT / "shiplog").rglob("*.py")
    found = [path.name for path in sources if switch in path.read_text(encoding="utf-8")]
    # and for the processes that a queue, or a cluster, starts for it
    own = ["cluster_blocks.py", "process.py", "queue.py"]
    assert sorted(found) == (own if switch == '"NPROC"' else [])
