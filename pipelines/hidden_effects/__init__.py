"""The blind test of the diagnosis: hide something, diagnose, seal the verdict, then open the key.

    suites → plan → run (one process a step) → verdict.json and its SHA-256 → score → tables
                    └ rivals: what simpler methods say of the same trial, sealed likewise

`suites` alone knows what can be hidden; `score`, `parameters` and `tables` read verdicts and keys
and import nothing of the simulator.
"""
