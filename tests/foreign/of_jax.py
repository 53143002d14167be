"""The function of `odd.rows` for JAX, and what a JAX user would write: no numpy in it."""

import jax.numpy as jnp


def f(state, inputs, t):
    _, u, _, v, psi, r = state
    delta, n = inputs[0], inputs[1]
    c, s = jnp.cos(psi), jnp.sin(psi)
    return jnp.array([u * c - v * s, jnp.tanh(n) - u, u * s + v * c, -v, r, delta - r])
