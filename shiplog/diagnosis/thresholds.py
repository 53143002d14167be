"""The thresholds between verdicts: name, unit, reason. Settings of one method are in its module.

Twelve decide between hypotheses. The others say when there is nothing to decide on, and what is
listed with a verdict. Priors are shares before any data. Nats are natural logarithms of a Bayes
factor.
"""

from __future__ import annotations

# --- between hypotheses

# Probability. A verdict is stated where its probability is at least this; nine in ten of such
# statements have to be right, which the calibration table checks.
STATED = 0.9

# Share of trials in which no cause acts, before any data.
NO_CHANGE = 0.5

# Share. How much rarer each further cause is than the one before it.
ANOTHER_CAUSE = 0.1

# Share of trials in which something remains that no cause of the catalogue explains.
REMAINDER = 0.15

# Share of a force or of a reading. A cause's equations are right to about this share, unless the
# cause says a larger one, and what they leave over imitates further causes; so does what an
# intermittent force leaves over. The evidence goes with the square: the log Bayes factor of each
# further cause has to exceed this squared times that of the cause, or force, that leaves most.
FORM_ERROR = 0.02

# Share of what a hypothesis explains, and of what a cause does. With a remainder, causes are named
# only where they explain at least this share, which is more than the remainder does: of the
# evidence, and of the held-out error beyond the nominal voyages'. A cause is named only where the
# remainder could do no more than this share of what the cause does. No change is stated only where
# the data leave at most this share of what the causes had before any data.
MOST = 0.5

# Share of what a hypothesis explains. A remainder that adds no more than this is an error of the
# causes' equations: a seventh of a force, since the evidence goes with the square. It puts no name
# in doubt.
SLIGHT = 0.02

# Share of the held-out error. Where a plain regression leaves less than this share of the model's
# error, the model lacks a force: causes that change forces are not tested.
BASELINE = 0.5

# Ratio of standard deviations. Process noise that is raised by less than this counts as no change:
# the force of gusts goes with the square of the wind speed, and a wind that is a quarter stronger
# than that of the nominal voyages is no fault of the model. A force at one place that varies as
# noise does counts as such.
ORDINARY_NOISE = 1.5

# Standard deviations of a campaign's process noise from voyage to voyage. Where voyages differ by
# more than ORDINARY_NOISE, noise that is raised by less than this is an ordinary day's, too: 95 %
# of nominal voyages are nearer.
ORDINARY_SPREADS = 2.0

# Share of the variance by which process noise is raised. No spectrum is known better than to a
# tenth: a change of the discrepancy that explains less of that noise is an error of its spectrum.
# In simulated trials turbulence lets a change explain 0.02 at most, and a line, a limit or a side
# force 0.26 at least.
SPECTRUM = 0.1

# Ratio of times. An unrecorded thruster is on or off: it is between for less than this share of the
# time that it is on. A force that merely varies is between as long as above; where a force is less
# than that, both are as probable.
BETWEEN = 0.5

# --- whether there is a verdict, and what is listed with it

# Seconds of unbroken record, below which there is no verdict: eight segments of a three-metre ship,
# which is as many as a nominal campaign needs.
LEAST_RECORD_S = 240.0

# Share of a window's seconds inside the training data. Below it the window is listed as not trained
# in these conditions.
COVERED = 0.5

# Share of the windows. Where more than this are not covered, an unknown dependence on motion,
# controls or wind is answered by `coverage`.
UNCOVERED_WINDOWS = 0.5

# Ratio of errors. A model whose error is at most this many times that of keeping all velocities
# simulates the ship; a cause named in any other would be a guess.
WORSE_THAN_HOLDING = 2.0

# Ratio of errors. Where turning a sign round leaves less than this share of the error with all that
# was named, the sign is wrong and no cause is named.
TURNED_SIGN = 0.5

# Share of the error that the trial has more than the nominal voyages. Where causes explain the
# trial about as well, a convention that takes away at least this much, with no number fitted, is
# the likelier explanation.
MOST_OF_EXCESS = 0.8

# The same, from which no causes are searched for: what is left is no more than a model's error
# varies from campaign to campaign.
ALL_EXCESS = 0.95

# Nats. A cause would show in these data from this expected log Bayes factor on: e^5 is 150 to 1.
SHOWS_NATS = 5.0

# Ratio. An unknown dependence acts on a channel that has at least this share of its largest
# acceleration, in units of the process noise.
ACTS = 1.0 / 3.0

# Standard deviations. A force is external where it exceeds all that the ship's own forces can be
# by so many standard deviations of its estimate.
EXTERNAL_SPREADS = 3.0

# Ratio. The misfit of this ship's model, times this, is allowed in addition to those forces; and at
# least what the nominal voyages have beyond them, which nothing pushed.
EXTERNAL_MISFIT = 5.0
