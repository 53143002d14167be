"""Terms of the method, for the pages of a verdict."""

TERMS = (
    ("L", "Error of a window of the simulation: weighted squares of the errors of surge, sway and "
     "yaw rate, integrated over time (Wakita et al. 2024, Eqs. 5 and 8). 0 is perfect."),
    ("held-out window", "A piece of a voyage that is simulated with numbers fitted without that "
     "voyage."),
    ("probability", "Of an answer, given these voyages and the catalogue; calibrated on simulated "
     "ships with known effects."),
    ("log Bayes factor, nats", "How much more probable the data are with a cause than without "
     "it, as a natural logarithm: 3 is 20 to 1, 7 is 1000 to 1."),
    ("90 % interval", "It contains the true value nine times in ten."),
    ("cannot tell it from", "Two causes change these voyages in the same way, within their noise."),
    ("outside the catalogue", "Something acts that none of the known causes explains; the word in "
     "brackets is what it depends on."),
    ("recorded time", "The voyages one after another, in the order of their start, without what "
     "lies between them."),
    ("missing force", "The force by which the model's acceleration differs from the ship's."),
    ("realistic size", "Of a cause: the size that changes found on real ships have, from the "
     "literature."),
)  # fmt: skip
