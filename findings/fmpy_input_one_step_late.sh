#!/usr/bin/env bash
# fmpy 0.3.32: of a co-simulation FMU the result of simulate_fmu has each input one output interval
# late: the row of a time has the input of the row before, as it is taken after the step and before
# the input of the new time is set. The first two rows have the same input. Who learns a model from the
# result finds a ship that answers its rudder before it is put over. A guess would be the input that was
# given for the time of the row.
#
# Seen: "rudder given at 0, 1, 2, 3, 4 s: 0 1 2 3 4, in the result: 0 0 1 2 3; growth of the rate of turn
# from each row to the next: 0 1 2 3".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'fmpy==0.3.32' 'pythonfmu==0.7.0' 'numpy==2.4.6'
cd "$work"
cat >ship.py <<'P'
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Ship(Fmi2Slave):
    """A ship whose rate of turn grows by the rudder angle each second."""

    def __init__(self, **key):
        super().__init__(**key)
        self.rudder, self.rate = 0.0, 0.0
        self.register_variable(Real("rudder", causality=Fmi2Causality.input))
        self.register_variable(Real("rate", causality=Fmi2Causality.output))

    def do_step(self, time, step):
        self.rate += self.rudder * step
        return True
P
"$work/venv/bin/python" -m pythonfmu build -f ship.py >/dev/null
"$work/venv/bin/python" - <<'P'
import numpy as np
from fmpy import simulate_fmu

given = np.array([(float(t), float(t)) for t in range(5)], dtype=[("time", "f8"), ("rudder", "f8")])
found = simulate_fmu(
    "Ship.fmu", stop_time=4.0, output_interval=1.0, input=given, output=["rudder", "rate"]
)
assert found["time"].tolist() == given["time"].tolist(), found["time"]
steps = np.diff(found["rate"])
text = [" ".join(f"{angle:g}" for angle in table["rudder"]) for table in (given, found)]
growth = " ".join(f"{step:g}" for step in steps)
print(
    f"rudder given at 0, 1, 2, 3, 4 s: {text[0]}, in the result: {text[1]}; growth of the rate of turn "
    f"from each row to the next: {growth}"
)
assert steps.tolist() == given["rudder"][:-1].tolist(), steps
assert found["rudder"].tolist() == [0.0, 0.0, 1.0, 2.0, 3.0], f"this has changed: {found['rudder']}"
P
