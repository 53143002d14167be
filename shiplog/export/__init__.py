"""A run's model in the files of other programs, each loaded again by the program and compared.

    run -> ship -> equations -> statements in a language -> a target's file -> trial: compared

`ship.of_run` takes from a run all that sailing it needs. `equations` is its ν̇ as a graph of
scalars, the same that `simulation.kernel` makes machine code of: extended causes and physical
models of any kind are exported without being written a second time. `targets.TARGETS` has a line
for each kind of file; `trial` is the schedule on which its consumer and `simulate` are compared.
"""
