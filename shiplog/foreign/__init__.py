"""Simulators that are not ours: a callable of Python, an FMU, or states that were logged.

A simulator is its owner's code, and runs in a child process: with limits of memory and time,
without network, and only where its path was given by hand in this call. Here it is

    ν̇ = f(x, u, ω),   x (x₀, u, y₀, v, ψ, r),   u the actuators, ω the wind over ground

| file | what it is |
| --- | --- |
| `source` | name, kind and SHA-256 of a simulator's file |
| `mapping` | the TOML that says which of its variables is which channel |
| `confinement`, `worker` | in the child: limits, and the answers to requests |
| `callables` | in the child: a Python function |
| `fmu_file`, `fmu`, `exchange` | in the child: what an FMU says of itself, and its two kinds |
| `bridge` | here: the child's other end |
| `model` | here: what the rest of shiplog asks of it, as of any model without coefficients |

An MMG of the ship, fitted to its accelerations, stands in for what causes change of the ship:
`training.physics.stand_in`.
"""
