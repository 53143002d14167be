"""The low-speed MMG model: one small function a force, one table of coefficients."""

from __future__ import annotations

import jax

jax.config.update("jax_enable_x64", True)  # sensitivities in float32 do not tell causes apart
