"""Whether a naval architect would believe the answer, data set by data set."""

from __future__ import annotations

JUDGEMENTS: dict[str, str] = {
    "esso-osaka": (
        "Believable. The tests are of one ship, from July to November 2020, and no change of the "
        "ship is known. In the berthings of 12 November the yaw rate is about 0.9 s late "
        "([below](#sensors-against-each-other)); such berthings are among the nominal voyages, "
        "too, so that this is no change between the two campaigns. Eight tests are too few "
        "to confirm it. On tests that were held out, the physics have half of the regression's L."
    ),
    "esso-osaka, published": (
        "Believable in part. The position's clock is right: the sensors alone give 0.95 s between "
        "position and velocity. So is the wind force: the coefficients identified from all "
        "voyages have 1.25 times the published one ahead and 0.47 times the yaw moment, and 0.81 "
        "times athwart. How fast the screw's revolutions change is confirmed by nothing else. The "
        "rudder's force, which those coefficients have 1.29 times as large, is missing from the "
        "answer. Half of the error is unexplained."
    ),
    "kvlcc2": (
        "Believable. All zigzags are of one series. On these six windows a plain regression "
        "predicts zigzags better than the physics, and `evaluate` says so."
    ),
    "kvlcc2, full scale": (
        "Believable. All six tests are of one series, and nothing is known to have changed. The "
        "probability of no change is 0.84: what is left is spread over causes that these tests do "
        "not favour, and do not exclude."
    ),
    "blueboat": (
        "Believable as far as it goes. Sixteen runs of one afternoon, two thirds of them with "
        "neutral thrust: nothing is known to have changed, and no cause is named. The model has a "
        "fifth of the L of holding the velocity: with so poor a model, neither of the two answers "
        "would be more than a guess."
    ),
    "milliampere": (
        "Believable. These are three runs at about 0.1 m/s; the answer says how much more is "
        "needed, and of what kind."
    ),
    "other_ship": (
        "Right. That campaign's README says a current of 0.12 m/s towards 140 deg, and nothing "
        "else."
    ),
    "usv_fuzhou": (
        "Believable as far as it goes. Position and velocity of the zigzag disagree by 8 deg, and "
        "these data cannot tell which of them is right. Two runs of 126 and 210 s at 2 Hz, one of "
        "them full of gaps, would be too little for a verdict in any case."
    ),
    "qixing": (
        "Believable. What drives the ship is not in the data. `ingest` says that the velocity "
        "comes 0.10 s after the position, half the sampling period of this 5 Hz receiver, in six "
        "of seven runs."
    ),
    "tycho-brahe": (
        "Believable. The table has the angles of the thrusters, as sines and cosines, but not "
        "their speeds: the input of a model is missing."
    ),
    "aurora": ("Right. This ferry's table has no heading."),
    "hakusan": (
        "Right. The data hold yaw rate, roll, pitch and the rudder in counts without a scale, and "
        "nothing else."
    ),
    "cybership": (
        "Believable. Both runs are of one campaign, and nothing is known to have changed. The "
        "model is poor, since the commands are those of Voith Schneider propellers, so that only "
        "large changes would have shown."
    ),
    "dalian": (
        "Right. The file is one run of four minutes, and 39 s of it are left for a test. What the "
        "draft guessed of the starboard thruster's sign is wrong, and `ingest` says so once the "
        "thrusters have places: with the sign turned, L falls from 29518 to 10070."
    ),
    "aava": (
        "Right. The yacht's rudder and engine are not in the log. Its sensors are compared: the "
        "velocity comes 1.2 s after the position, as a receiver's filter makes it."
    ),
    "merrimac": ("Right. A yacht at its berth shows nothing but its instruments' noise."),
    "mcap, location": (
        "Right. The log holds a position and a sensor, and no vehicle that is steered."
    ),
    "mcap, battery": ("Right. The log holds the position, speed and battery of a car."),
    "mcap, AIS": ("Right. Four seconds of AIS hold one or two reports of a ship, and no actuator."),
}
