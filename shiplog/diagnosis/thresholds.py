"""Every number that a verdict depends on: name, unit, reason. No other module decides by a number.

Priors are shares before any data. Nats are natural logarithms of a Bayes factor.
"""

from __future__ import annotations

# probability. A verdict is stated where its probability is at least this; nine in ten of such
# statements have to be right, which the calibration table checks.
STATED = 0.9

# share. Somebody who asks for a diagnosis has a reason to: one trial in three shows no change.
NO_CHANGE = 1.0 / 3.0

# share. Of the hypotheses with a cause, how many have one more cause (and again with three).
ANOTHER_CAUSE = 0.1

# share. How often something remains that no cause of the catalogue explains: raised process noise,
# an intermittent force, or a dependence on position, heading, time, motion, controls or wind.
REMAINDER = 0.15

# share of the held-out error. Where a plain regression leaves less than this share of the model's
# error, the model lacks a force: causes that change forces are not tested.
BASELINE = 0.5

# share. A cause is a name for a trial only where it explains at least this share of what all of the
# hypothesis explains; a smaller part beside a remainder is no answer to what is wrong.
MOST = 0.5
