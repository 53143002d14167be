"""The program with one part of its decision taken out, to see what that part is for.

python -m pipelines.experiments.hidden_effects.without PART diagnose RUN ...
    as `shiplog diagnose RUN ...`, without that part; `nothing`: as it is, and from the same search
    without each part that acts after it
python -m pipelines.experiments.hidden_effects.without --ablate DIR [--jobs N] [--only PART ...]
    the kept cases of DIR, diagnosed as they are and without each part in turn, into DIR-without/;
    with --every 7 the first of each seven cases, with --first 20 so many of these; --only also
    takes before-search and after-search, the parts that act there
python -m pipelines.experiments.hidden_effects.without --page DIR-without ... [--markdown FILE]
    a page of what was found: how many are right, how many are misnamed, and which answers change
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np

from pipelines.experiments.hidden_effects import ablation, one_search, replay
from pipelines.experiments.hidden_effects.ablation import WHOLE
from pipelines.experiments.hidden_effects.one_search import Part
from pipelines.experiments.hidden_effects.plan import positive
from pipelines.experiments.hidden_effects.program import ROOT, identity, name
from pipelines.experiments.hidden_effects.run import Settings
from shiplog import cli
from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import evidence, fits
from shiplog.diagnosis.hypotheses.intermittent import ResidualNoise
from shiplog.diagnosis.noise import discrepancy
from shiplog.diagnosis.noise.remainder import INTERMITTENT
from shiplog.diagnosis.nominal import (
    campaign_characteristics,
    nominal_cache,
    nominal_fit,
    placebo,
    voyage_effects,
)
from shiplog.diagnosis.trial import trial_voyages
from shiplog.diagnosis.verdict import baseline_check, posterior, refutation
from shiplog.machine import files
from shiplog.models.causes import CATALOGUE


def _no_placebo(stack: ExitStack) -> None:
    stack.enter_context(patch.object(placebo, "placebos", lambda campaign: {}))
    stack.enter_context(patch.object(ResidualNoise, "nominal", None))


def _no_form_error(stack: ExitStack) -> None:
    stack.enter_context(patch.object(thresholds, "FORM_ERROR", 0.0))
    for coarse in {type(cause) for cause in CATALOGUE if cause.form_error}:
        stack.enter_context(patch.object(coarse, "form_error", 0.0))


def _no_discrepancy(stack: ExitStack) -> None:
    """Nor in the nominal fit, which then is neither read from the cache nor kept there: its key
    does not hold the part."""

    def converged(*given):
        return nominal_fit.converged(*given, seen=discrepancy.SEEN)

    stack.enter_context(patch.object(discrepancy, "SEEN", ()))
    stack.enter_context(patch.object(nominal_cache, "converged", converged))
    _learned_anew(stack)


def _voyages_alike(stack: ExitStack) -> None:
    """No part of a campaign differs from another."""
    learned = nominal_cache.characteristics

    def alike(*given):
        found = learned(*given)
        least = dict.fromkeys(found.deviation, voyage_effects.LEAST_DEVIATION)
        return replace(found, deviation=least)

    stack.enter_context(patch.object(nominal_cache, "characteristics", alike))


def _whole_share(stack: ExitStack) -> None:
    """A trial counts all of itself."""
    learned = nominal_cache.characteristics

    def whole(*given):
        return replace(learned(*given), share=1.0)

    stack.enter_context(patch.object(nominal_cache, "characteristics", whole))


def _no_robust_weights(stack: ExitStack) -> None:
    def plain(square, kept):
        return np.where(kept, 1.0, 0.0)

    for module in (campaign_characteristics, evidence):
        stack.enter_context(patch.object(module, "robust_weights", plain))
    _learned_anew(stack)


def _no_refutation(stack: ExitStack) -> None:
    judged = refutation.judged

    def unjudged(search, held):
        decision, found, _, refuted = judged(search, None)
        gain = held.gain(decision) if held is not None and decision.named else None
        return decision, found, gain, refuted

    stack.enter_context(patch.object(refutation, "judged", unjudged))


def _no_baseline(stack: ExitStack) -> None:
    stack.enter_context(patch.object(baseline_check, "lacking", lambda *given: ""))


def _no_practical_size(stack: ExitStack) -> None:
    stack.enter_context(
        patch.object(posterior, "practical", lambda table, one: dict.fromkeys(one.causes, 1.0))
    )


def _no_share_of_causes(stack: ExitStack) -> None:
    """A cause is named however small a share of the error it explains."""
    stack.enter_context(patch.object(thresholds, "MOST", 0.0))
    _no_imitation(stack)  # which asks for that number the other way round


def _no_imitation(stack: ExitStack) -> None:
    """A cause is named though the remainder next to it could do most of what it does."""
    stack.enter_context(patch.object(fits, "share_imitated", lambda *given: 0.0))


def _none_slight(stack: ExitStack) -> None:
    """However little a remainder explains, it may put a name in doubt."""
    stack.enter_context(patch.object(thresholds, "SLIGHT", 0.0))


def _no_error_of_spectrum(stack: ExitStack) -> None:
    """A change of the discrepancy counts however little of raised noise it explains."""
    stack.enter_context(patch.object(thresholds, "SPECTRUM", 0.0))


def _no_ordinary_noise(stack: ExitStack) -> None:
    """Noise that is raised by anything is a remainder."""
    stack.enter_context(patch.object(thresholds, "ORDINARY_NOISE", 1.0))


def _no_ordinary_spreads(stack: ExitStack) -> None:
    """How far the noise differs from voyage to voyage does not count."""
    stack.enter_context(patch.object(thresholds, "ORDINARY_SPREADS", 0.0))


def _no_pattern(stack: ExitStack) -> None:
    """An intermittent force is one device where a course that is on or off is more probable."""

    def device(one):
        force = one.side_force
        return float(one.kind == INTERMITTENT and force is not None and force.course is not None)

    stack.enter_context(patch.object(posterior, "device", device))


def _fixed_time_scale(stack: ExitStack) -> None:
    """Segments of 30 s whatever the ship."""

    def as_they_are(run, nominal, recorded):
        return nominal, recorded

    stack.enter_context(patch.object(trial_voyages, "in_ship_time", as_they_are))


def _learned_anew(stack: ExitStack) -> None:
    """What is kept in the cache was learned with the part."""

    def learned(*given):
        return campaign_characteristics.characteristics(*given)

    stack.enter_context(patch.object(nominal_cache, "characteristics", learned))


BEFORE_SEARCH: Mapping[str, Part] = {
    "placebo": _no_placebo,
    "form-error": _no_form_error,
    "discrepancy": _no_discrepancy,
    "voyage-effects": _voyages_alike,
    "share-of-trial": _whole_share,
    "robust-weights": _no_robust_weights,
    "baseline": _no_baseline,
    "spectrum": _no_error_of_spectrum,
    "time-scale": _fixed_time_scale,
}
AFTER_SEARCH: Mapping[str, Part] = {
    "refutation": _no_refutation,
    "practical-size": _no_practical_size,
    "share-of-causes": _no_share_of_causes,
    "imitation": _no_imitation,
    "slight": _none_slight,
    "ordinary-noise": _no_ordinary_noise,
    "ordinary-spreads": _no_ordinary_spreads,
    "pattern": _no_pattern,
}
GROUPS = {"before-search": BEFORE_SEARCH, "after-search": AFTER_SEARCH}
PARTS: Mapping[str, Part] = {WHOLE: lambda stack: None, **BEFORE_SEARCH, **AFTER_SEARCH}


def main(arguments: Sequence[str] | None = None) -> int:
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given and given[0] == WHOLE:
        one_search.diagnose(given[1:], AFTER_SEARCH)
    if given and given[0] in PARTS:
        with ExitStack() as stack:
            PARTS[given[0]](stack)
            sys.argv = ["shiplog", *given[1:]]
            cli.main()
        return 0
    parser = argparse.ArgumentParser(
        prog="python -m pipelines.experiments.hidden_effects.without",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--ablate", type=Path, metavar="DIR")
    what.add_argument("--page", type=Path, nargs="+", metavar="DIR-without")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", nargs="*", choices=[*PARTS, *GROUPS], default=list(GROUPS))
    parser.add_argument(
        "--every", type=positive, default=1, metavar="N", help="one case of so many"
    )
    parser.add_argument("--first", type=positive, metavar="N", help="of these, so many")
    parser.add_argument("--markdown", type=Path, metavar="FILE")
    asked = parser.parse_args(given)
    if asked.ablate:
        only = (part for word in asked.only for part in GROUPS.get(word, (word,)))
        parts = dict.fromkeys((WHOLE, *only))
        without_each(asked.ablate, parts, asked.jobs, asked.every, asked.first)
        return 0
    text = ablation.page([ablation.answers_in(folder) for folder in asked.page])
    if asked.markdown is None:
        print(text)
    else:
        files.write_text(asked.markdown, text + "\n")
    return 0


def without_each(
    source: Path, parts: Iterable[str], jobs: int, every: int = 1, first: int | None = None
) -> None:
    """Ask a test's kept cases again without each part, one case of so many, into a folder next to
    it: a folder a part."""
    source_of = name(identity())
    into = source.with_name(f"{source.name}-without")
    for part in (one for one in parts if one not in AFTER_SEARCH):
        out = into / part
        command = (sys.executable, "-m", "pipelines.experiments.hidden_effects.without", part)
        with patch.dict(os.environ, PYTHONPATH=_with_this_source()):
            called = source_of if part == WHOLE else f"{source_of} without {part}"
            settings = Settings(jobs=jobs, shiplog=command, called=called)
            replay.replay(source, out, settings, every, first)
    one_search.distribute(into / WHOLE, {p: into / p for p in parts if p in AFTER_SEARCH})


def _with_this_source() -> str:
    """Where Python looks for modules: here first, since a step runs in the folder of its case and
    an installed shiplog has no experiments."""
    return os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))


if __name__ == "__main__":
    sys.exit(main())
