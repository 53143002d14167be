#!/usr/bin/env bash
# ahrs 0.4.0: the date that a WMM is made with is forgotten as soon as its field is asked for at a
# place. magnetic_field has a date of its own whose default is the day on which the package was
# imported, so that two models of 2016 and 2021 give one declination, today's. Given to
# magnetic_field the dates count. A guess would be the model's date.
#
# Seen: "WMM(date=...) of 2016 and 2021: the same declination; magnetic_field(..., date=...): 2.58 and
# 3.68 degrees".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'ahrs==0.4.0' 'numpy==2.4.6'
"$work/venv/bin/python" - <<'P'
from datetime import date

from ahrs.utils import WMM

PLACE = (60.0, 10.0, 0.0)  # latitude, longitude in degrees, height in km
DATES = date(2016, 1, 1), date(2021, 1, 1)


def of_model(day: date) -> float:
    model = WMM(date=day)
    model.magnetic_field(*PLACE)
    return float(model.D)


def of_call(day: date) -> float:
    model = WMM()
    model.magnetic_field(*PLACE, date=day)
    return float(model.D)


models, calls = [of_model(day) for day in DATES], [of_call(day) for day in DATES]
same = "the same declination" if models[0] == models[1] else f"{models}"
print(
    f"WMM(date=...) of 2016 and 2021: {same}; magnetic_field(..., date=...): {calls[0]:.2f} and "
    f"{calls[1]:.2f} degrees"
)
assert [round(value, 2) for value in calls] == [2.58, 3.68], f"this has changed: {calls}"
assert models[0] == models[1] and models[0] not in calls, f"this has changed: {models}"
P
