#!/usr/bin/env bash
# jax 0.10.2: what is one function has another slope at its corner with each way to write it. At the
# limit of a rudder clip has half of the slope, clamp none; with equal limits, as of a coefficient that
# is held, clip has a quarter. The slope of |v| at rest is that to starboard, 1, though the rule for
# its mirror image gives -1; so the second derivative of a drag v |v| at rest is 2, not 0. A guess would
# be one rule for all (casadi 3.8.2: a half for each corner, 0 for |v| and for the drag).
#
# Seen: "limited at its limit: clip 0.5, clamp 0, minimum 0.5, where 0, clip to one value 0.25; from zero
# up: maximum 0.5, relu 0; |v| at rest: slope 1; v |v| at rest: second derivative 2; casadi: 0.5, 0, 0".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'jax==0.10.2' 'casadi==3.8.2' 'numpy==2.4.6'
JAX_PLATFORMS=cpu "$work/venv/bin/python" - <<'P'
import casadi as ca
import jax
import jax.numpy as jnp

LIMIT = 0.5
limited = {
    "clip": lambda x: jnp.clip(x, -LIMIT, LIMIT),
    "clamp": lambda x: jax.lax.clamp(-LIMIT, x, LIMIT),
    "minimum": lambda x: jnp.minimum(x, LIMIT),
    "where": lambda x: jnp.where(x < LIMIT, x, LIMIT),
    "clip to one value": lambda x: jnp.clip(x, LIMIT, LIMIT),
}
upward = {"maximum": lambda x: jnp.maximum(x, 0.0), "relu": jax.nn.relu}
at_limit = {name: float(jax.grad(way)(LIMIT)) for name, way in limited.items()}
at_zero = {name: float(jax.grad(way)(0.0)) for name, way in upward.items()}
rest = float(jax.grad(jnp.abs)(0.0))
drag = float(jax.grad(jax.grad(lambda v: v * jnp.abs(v)))(0.0))
v = ca.SX.sym("v")
other = [ca.fmin(v, 0.0), ca.fabs(v), ca.gradient(v * ca.fabs(v), v)]
peer = [float(ca.Function("slope", [v], [ca.gradient(way, v)])(0.0)) for way in other]


def told(slopes: dict[str, float]) -> str:
    return ", ".join(f"{name} {slope:g}" for name, slope in slopes.items())


print(
    f"limited at its limit: {told(at_limit)}; from zero up: {told(at_zero)}; |v| at rest: slope "
    f"{rest:g}; v |v| at rest: second derivative {drag:g}; casadi: "
    f"{', '.join(f'{slope:g}' for slope in peer)}"
)
assert list(at_limit.values()) == [0.5, 0.0, 0.5, 0.0, 0.25], f"this has changed: {at_limit}"
assert list(at_zero.values()) == [0.5, 0.0], f"this has changed: {at_zero}"
found = rest, drag, *peer
assert found == (1.0, 2.0, 0.5, 0.0, 0.0), f"this has changed: {found}"
P
