#!/usr/bin/env bash
# aiscat 0.68.16: a ship's rate of turn from AIS, (ROT_AIS / 4.733)^2 degrees a minute with the sign
# of ROT_AIS (ITU-R M.1371-5, table 45), is rounded to the nearest whole number to starboard, but one
# half is added before the fraction is cut off to port too: -2.19 becomes -1. A guess would be the
# same rate for both sides. pyais, which made the two sentences, reads its own as 2 and -2.
#
# Seen: "ROT_AIS 7 is a turn of 2, -7 one of -1; 15: 10, -15: -9".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'aiscat==0.68.16' 'pyais==3.3.1'
"$work/venv/bin/python" - <<'P'
import aiscat
import pyais


def read(turn: float) -> tuple[int, int]:
    report = {"msg_type": 1, "mmsi": 257000000, "lat": 59.9, "lon": 10.7, "turn": turn}
    (sentence,) = pyais.encode_dict(report, talker_id="AI", sentence_type="VDM")
    assert pyais.decode(sentence).turn == turn, pyais.decode(sentence)
    found = aiscat.decode(sentence)
    return found["turn_unscaled"], found["turn"]


slow, fast = (read(2.0), read(-2.0)), (read(10.0), read(-10.0))
assert [raw for raw, _ in slow + fast] == [7, -7, 15, -15], (slow, fast)
turns = [turn for _, turn in slow + fast]
print(f"ROT_AIS 7 is a turn of {turns[0]}, -7 one of {turns[1]}; 15: {turns[2]}, -15: {turns[3]}")
assert turns == [2, -1, 10, -9], f"this has changed: {turns}"
P
