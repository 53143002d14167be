"""What a sentence says of its own values: no fix, dead reckoning, typed in by hand, simulated.

What an instrument itself calls no measurement is blank, and the log's report says so. The letters
are those of NMEA 0183 4.11: quality of GGA, status A or V, mode of RMC, VTG, GLL, GNS and THS.
"""

from __future__ import annotations

QUALITIES = {  # of GGA; what is not listed is a fix
    "": "no fix (quality blank)",
    "0": "no fix (quality 0)",
    "6": "dead reckoning (quality 6)",
    "7": "manual input (quality 7)",
    "8": "a simulator (quality 8)",
}
MODES = {  # A, D, F, P, R are measured; receivers older than NMEA 2.3 send none
    "E": "dead reckoning (mode E)",
    "M": "manual input (mode M)",
    "S": "a simulator (mode S)",
    "N": "no fix (mode N)",
}
MEASURED = frozenset("ADFPR")
NO_FIX = "a position of 0 N, 0 E, which is no fix"
PLACEHOLDER = "a time that stands still, which is a placeholder"
NOT_VALID = "no valid value (status V)"


def quality(letter: str) -> str:
    """Why a GGA is no measurement; empty where it is one."""
    return QUALITIES.get(letter, "")


def status(letter: str, mode: str = "") -> str:
    """Why a sentence of a status (A or V; blank in old ones) and a mode is no measurement."""
    if letter == "V":
        return MODES.get(mode, NOT_VALID)
    return MODES.get(mode, "")


def modes(letters: str) -> str:
    """Why a GNS is no measurement, of whose letters each is of one satellite system."""
    if not letters or MEASURED & set(letters):
        return MODES["S"] if "S" in letters else "" if letters else MODES["N"]
    return next((MODES[m] for m in "SEMN" if m in letters), MODES["N"])


def valid(letter: str) -> str:
    """Why a value with a status of its own, as of ROT, MWV, RSA and RPM, is no measurement."""
    return NOT_VALID if letter == "V" else ""


def heading(mode: str) -> str:
    """Why a THS is no measurement: A is autonomous, all else is not."""
    return "no valid value (mode V)" if mode == "V" else MODES.get(mode, "")
