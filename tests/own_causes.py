"""A cause that is not in the catalogue, as a user writes it."""

GOOD = '''
import jax.numpy as jnp
from shiplog.models.causes import Cause, Parameter


class Tide(Cause):
    """Pulls north, always."""

    name = "tide_gate"
    kind = "environment"
    story = "Something pulls."
    equation = "X = {north:.1f} N along the earth's axes"
    parameters = (Parameter("north", "N", 2.0, 0.1),)

    def force(self, p, state, at):
        c, s = jnp.cos(state[..., 4]), jnp.sin(state[..., 4])
        return jnp.stack((c * p[0], -s * p[0], 0.0 * c), -1)
'''
