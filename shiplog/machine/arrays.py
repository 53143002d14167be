"""`jnp`: the equations' arithmetic, of numpy's arrays by numpy and of JAX's by JAX.

Equations are written once. Traced by JAX they become a kernel; given numbers, they are worked out
with them at once, in double precision and without JAX, which takes a second to load.
"""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any

import numpy as np


def of_jax(values: Any) -> bool:
    """Whether any of these, however deep in lists, is an array of JAX's or a traced one."""
    if isinstance(values, list | tuple):
        return any(of_jax(one) for one in values)
    return isinstance(values, sys.modules["jax"].Array)


class _Either:
    """The functions of numpy and of jax.numpy, by what they are given."""

    def __getattr__(self, name: str) -> Any:
        by_numpy = getattr(np, name)
        if not callable(by_numpy):
            return by_numpy

        def either(*given: Any, **named: Any) -> Any:
            if "jax" in sys.modules and of_jax((*given, *named.values())):
                import jax.numpy

                return getattr(jax.numpy, name)(*given, **named)
            return by_numpy(*given, **named)

        setattr(self, name, either)
        return either


def double() -> AbstractContextManager[Any]:
    """JAX, where it is there, in double precision until the block ends."""
    if "jax" not in sys.modules:
        return nullcontext()
    from shiplog.machine import jit_cache

    return jit_cache.double()


def numbers(values: Any, count: int) -> list[Any]:
    """The numbers of a vector, one by one.

    JAX splits, and does not index: reverse mode adds up a whole vector for every index.
    """
    if "jax" in sys.modules and of_jax(values):
        from jax import lax

        return [part[0] for part in lax.split(values, [1] * count)]
    return list(np.asarray(values))


def put(values: Any, columns: Any, new: Any) -> Any:
    """Values [..., n] with others in some columns."""
    if "jax" in sys.modules and of_jax((values, new)):
        import jax.numpy

        return jax.numpy.asarray(values).at[..., columns].set(new)
    made = np.array(values)
    made[..., columns] = new
    return made


Array = Any  # of numpy or of JAX
if TYPE_CHECKING:
    import jax.numpy as jnp
else:
    jnp = _Either()
