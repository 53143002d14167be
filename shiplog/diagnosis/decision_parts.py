"""Parts of the decision that can be left out, to see what each is for.

They are handed to a diagnosis, from the search to the verdict. The whole decision has them all.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Parts:
    """Whether each part acts.

    placebo           what a cause or remainder gains on nominal voyages is subtracted
    form_error        a cause's equations have errors, which further causes may imitate
    voyage_effects    voyages and their parts differ
    share_of_trial    a trial counts for a share of itself
    baseline          a model that lacks a force is noticed
    spectrum          a change of the discrepancy has to explain some of the raised noise
    time_scale        segments are as long as suits the ship, and not 30 s
    refutation        held-out voyages may refute a cause
    practical_size    a cause has to be of practical size
    share_of_causes   causes have to explain most of what a hypothesis explains
    imitation         a remainder that could imitate a cause puts it in doubt
    slight            a remainder that explains little puts no name in doubt
    ordinary_noise    process noise that is raised a little is nominal
    ordinary_spreads  the same, as far as voyages differ
    pattern           a force is one device by its pattern, not by the course alone
    """

    placebo: bool = True
    form_error: bool = True
    voyage_effects: bool = True
    share_of_trial: bool = True
    baseline: bool = True
    spectrum: bool = True
    time_scale: bool = True
    refutation: bool = True
    practical_size: bool = True
    share_of_causes: bool = True
    imitation: bool = True
    slight: bool = True
    ordinary_noise: bool = True
    ordinary_spreads: bool = True
    pattern: bool = True


ALL = Parts()
