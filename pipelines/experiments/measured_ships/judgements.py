"""Whether a naval architect would believe the answer, data set by data set."""

from __future__ import annotations

JUDGEMENTS: dict[str, str] = {
    "esso-osaka": (
        "Believable. All trials are of one ship in one summer, so that no change is what to "
        "expect; physics leave half of the regression's L on trials that were held out."
    ),
    "esso-osaka, published": (
        "Half of it. The position's clock is right: the sensors alone say 0.95 s between position "
        "and velocity. That the wind pushes half as hard athwart as published, the random trials "
        "alone say, too. The antenna's offset of a tenth of a metre is unconfirmed, and half of "
        "the error is left."
    ),
    "kvlcc2": (
        "Believable. All zigzags are of one series. On these six windows a plain regression "
        "predicts zigzags better than the physics, and `evaluate` says so."
    ),
    "kvlcc2, full scale": ("Believable. All six tests are of one series."),
    "blueboat": (
        "Believable. Sixteen runs of one afternoon, two thirds of them with neutral thrust: "
        "nothing is known to have changed, and the data are too few to be sure of it."
    ),
    "milliampere": (
        "Believable. Three runs at about 0.1 m/s: it says how much more is needed, and of "
        "what kind."
    ),
    "other_ship": (
        "Right. That campaign's README says 0.12 m/s towards 140 deg, and nothing else."
    ),
    "usv_fuzhou": (
        "Believable. Two runs of 126 and 210 s at 2 Hz, one of them full of gaps: a smoke test."
    ),
    "qixing": (
        "Believable. What drives the ship is not in the data. `ingest` says that the velocity "
        "comes 0.10 s after the position, half an interval of this 5 Hz receiver, in six of "
        "seven runs."
    ),
    "tycho-brahe": (
        "Believable. The angles of the thrusters are in the table as sines and cosines, their "
        "speeds not at all: a model has nothing to be driven by."
    ),
    "aurora": ("Right. This ferry's table has no heading."),
    "hakusan": (
        "Right. Yaw rate, roll, pitch and rudder in counts without a scale are all there is."
    ),
    "mcap, location": ("Right. A position and a sensor, of no vehicle that steers."),
    "mcap, battery": ("Right. A car's position, speed and battery."),
    "mcap, AIS": ("Right. Four seconds of AIS hold one or two reports of a ship."),
}
