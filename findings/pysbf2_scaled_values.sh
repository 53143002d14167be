#!/usr/bin/env bash
# pysbf2 1.0.7 writes a scaled value of a Septentrio block cut off, not rounded: a value that it has read
# and writes again may be one step smaller. Of 2000 horizontal accuracies of whole centimetres 253 are
# 1 cm less, and of 2000 latencies of whole 0.1 ms 610. And what a receiver marks as not available comes
# scaled, as a number that could be measured: 65535 is an accuracy of 655.35 m, where the unscaled
# latitude is -2e10. A guess would be the value that was written, and none where there is none.
#
# Seen: "of 2000 accuracies and 2000 latencies written and read again 253 and 610 are one step less, such as
# 0.28 m of 0.29 m; not available: accuracy 655.35 m, latitude -2e+10 rad".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'pysbf2==1.0.7' 'pynmeagps==1.1.8'
"$work/venv/bin/python" -W ignore - <<'P'
from pysbf2 import SBFMessage, SBFReader


def again(**values):
    """A PVTGeodetic with these values, written and read."""
    return SBFReader.parse(SBFMessage("PVTGeodetic", 2, TOW=518_400_000, WNc=2400, **values).serialize())


less, first = {"HAccuracy": 0, "Latency": 0}, None
for name, step in (("HAccuracy", 0.01), ("Latency", 0.0001)):
    for k in range(1, 2001):
        value = round(k * step, 4)
        found = getattr(again(**{name: value}), name)
        off = round((found - value) / step)
        assert off in (0, -1), (name, value, found)
        less[name] -= off
        first = first or (found, value) if off else first
missing = again(HAccuracy=655.35, Latitude=-2e10)
print(
    f"of 2000 accuracies and 2000 latencies written and read again {less['HAccuracy']} and "
    f"{less['Latency']} are one step less, such as {first[0]:g} m of {first[1]:g} m; not available: "
    f"accuracy {missing.HAccuracy:g} m, latitude {missing.Latitude:g} rad"
)
assert less == {"HAccuracy": 253, "Latency": 610}, f"this has changed: {less}"
assert (missing.HAccuracy, missing.Latitude) == (655.35, -2e10), "this has changed"
P
