#!/usr/bin/env bash
# pyais 3.3.1: a field that is None, as asdict gives it where a message was cut short, is left out of
# the encoded message, and all fields after it move up by its width. The sentence is shorter, but its
# checksum is right, and pyais reads the ship at another place. A guess would be the code for "not
# available" (-128 for the rate of turn, 511 for the heading), or an error.
#
# Seen: "10.7 E 59.9 N at 10.2 knots; without a turn: 54.845553 E -100.638595 N at 51.5 knots; without a
# speed: 219.382217 E 44.838047 N at 1.2 knots; without a heading: heading 270, second 0".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'pyais==3.3.1'
"$work/venv/bin/python" - <<'P'
import pyais

REPORT = {"msg_type": 1, "mmsi": 257000000, "turn": 0, "speed": 10.2, "lon": 10.7, "lat": 59.9}
REPORT |= {"course": 120.0, "heading": 90, "second": 33}


def read(**change: None) -> object:
    (sentence,) = pyais.encode_dict(REPORT | change, talker_id="AI", sentence_type="VDM")
    assert pyais.NMEAMessage(sentence.encode()).is_valid, sentence
    return pyais.decode(sentence)


def place(ship: object) -> str:
    return f"{ship.lon} E {ship.lat} N at {ship.speed} knots"


turn, speed, heading = read(turn=None), read(speed=None), read(heading=None)
print(
    f"{place(read())}; without a turn: {place(turn)}; without a speed: {place(speed)}; "
    f"without a heading: heading {heading.heading}, second {heading.second}"
)
assert place(read()) == "10.7 E 59.9 N at 10.2 knots"
assert (turn.lon, turn.lat, turn.speed) == (54.845553, -100.638595, 51.5), "this has changed"
assert (speed.lon, speed.lat, speed.speed) == (219.382217, 44.838047, 1.2), "this has changed"
assert (heading.heading, heading.second) == (270, 0), "this has changed"
P
