"""The blind test of the diagnosis: hide something, diagnose, seal the verdict, then open the key.

    suites → plan → run (one process a step) → verdict.json and its SHA-256 → score → tables
                    ├ rivals: what simpler methods say of the same trial, sealed likewise
                    └ replay: kept cases, diagnosed again by the program as it is now
    score → goals, scores, reliability, ranks → validation: one page of one program

`suites` alone knows what can be hidden; all that scores reads verdicts and keys
and imports nothing of the simulator.
"""
