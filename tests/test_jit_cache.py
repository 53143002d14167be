"""What is traced once is the same function, and never one that something has changed since."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from shiplog.machine import disk_cache, trees
from shiplog.machine.jit_cache import Traced
from shiplog.models.causes import CATALOGUE
from shiplog.models.causes.environment import Current

X = np.array([1.0, 2.0, 3.0])
traces = []


def bent(model, x, step, *, power=2):
    """Notes that it was traced; `model` counts for nothing."""
    traces.append(1)
    return {"sum": (x**power).sum() * step, "each": x + step}


@pytest.fixture(autouse=True)
def counted(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    traces.clear()
    return tmp_path / "shiplog" / "traced"


def same(found, power=2, step=0.5):
    assert float(found["sum"]) == pytest.approx(step * (X**power).sum(), rel=1e-15)
    assert np.asarray(found["each"]) == pytest.approx(X + step, rel=1e-15)


def test_it_is_traced_once_and_then_loaded(counted):
    same(Traced(bent)((), X, 0.5))
    assert traces and len(list(counted.glob("*.bin"))) == 1
    traces.clear()
    again = Traced(bent)  # as another process would have it
    same(again((), X, 0.5))
    same(again((), X, 0.25), step=0.25)
    assert not traces


@pytest.mark.parametrize("changed", ("shape", "static", "structure", "source"))
def test_what_changed_is_traced_anew(changed, monkeypatch):
    Traced(bent)((), X, 0.5)
    traces.clear()
    if changed == "shape":
        found = Traced(bent)((), X[:2], 0.5)
        assert float(found["sum"]) == pytest.approx(2.5)
    elif changed == "static":
        same(Traced(bent)((), X, 0.5, power=3), power=3)
    elif changed == "structure":
        same(Traced(bent)((X,), X, 0.5))
    else:
        monkeypatch.setattr(disk_cache, "source", lambda: b"another")
        same(Traced(bent)((), X, 0.5))
    assert traces


def test_what_is_broken_is_traced_again_and_mended(counted):
    Traced(bent)((), X, 0.5)
    (kept,) = counted.glob("*.bin")
    whole = kept.read_bytes()
    kept.write_bytes(whole[: len(whole) // 2])
    traces.clear()
    same(Traced(bent)((), X, 0.5))
    assert traces
    traces.clear()
    same(Traced(bent)((), X, 0.5))
    assert not traces


@jax.tree_util.register_static
@dataclass(frozen=True)
class Stranger:
    """Equations that somebody else wrote, and may write otherwise tomorrow."""

    power: int = 2


class Tide(Current):
    """Likewise, of a cause of the user's own."""


@trees.tree((), ["causes"])
@dataclass(frozen=True)
class Held:
    causes: tuple


Held.__module__ = "shiplog.somewhere"


@pytest.mark.parametrize("static", (Stranger(), Held((Tide(),)), [Held((1, (Tide(),)))]), ids=str)
def test_equations_of_others_are_not_kept(counted, static):
    same(Traced(bent)(static, X, 0.5))
    assert traces and not list(counted.glob("*"))


def test_every_cause_of_the_catalogue_is_distinguished_from_the_others(counted):
    """Each in its own file: what a cause consists of is in its name and numbers."""
    for cause in CATALOGUE:
        same(Traced(bent)(Held((cause,)), X, 0.5))
    assert len(list(counted.glob("*.bin"))) == len(CATALOGUE)


def test_within_a_trace_it_is_the_function_itself():
    inner = Traced(bent)
    slope = jax.jit(jax.grad(lambda x: inner((), x, 0.5)["sum"]))(jnp.asarray(X))
    assert np.asarray(slope) == pytest.approx(X, rel=1e-12)


def test_where_nothing_can_be_kept_it_works_all_the_same(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    same(Traced(bent)((), X, 0.5))
