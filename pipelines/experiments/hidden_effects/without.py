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
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from unittest.mock import patch

import numpy as np

from pipelines.experiments.hidden_effects import ablation, one_search, replay
from pipelines.experiments.hidden_effects.ablation import WHOLE
from pipelines.experiments.hidden_effects.plan import positive
from pipelines.experiments.hidden_effects.program import ROOT, identity, name
from pipelines.experiments.hidden_effects.run import Settings
from shiplog import cli
from shiplog.diagnosis.decision_parts import ALL, Parts
from shiplog.diagnosis.hypotheses import as_it_stands
from shiplog.diagnosis.noise import discrepancy
from shiplog.diagnosis.nominal import campaign_characteristics, nominal_cache, nominal_fit
from shiplog.machine import files

BEFORE_SEARCH: Mapping[str, Parts] = {
    "placebo": Parts(placebo=False),
    "form-error": Parts(form_error=False),
    "discrepancy": ALL,  # of the nominal fit: see `ESTIMATES`
    "voyage-effects": Parts(voyage_effects=False),
    "share-of-trial": Parts(share_of_trial=False),
    "robust-weights": ALL,
    "baseline": Parts(baseline=False),
    "spectrum": Parts(spectrum=False),
    "time-scale": Parts(time_scale=False),
}
AFTER_SEARCH: Mapping[str, Parts] = {
    "refutation": Parts(refutation=False),
    "practical-size": Parts(practical_size=False),
    # with `imitation`, which asks for that share the other way round
    "share-of-causes": Parts(share_of_causes=False, imitation=False),
    "imitation": Parts(imitation=False),
    "slight": Parts(slight=False),
    "ordinary-noise": Parts(ordinary_noise=False),
    "ordinary-spreads": Parts(ordinary_spreads=False),
    "pattern": Parts(pattern=False),
}
GROUPS = {"before-search": BEFORE_SEARCH, "after-search": AFTER_SEARCH}
PARTS: Mapping[str, Parts] = {WHOLE: ALL, **BEFORE_SEARCH, **AFTER_SEARCH}


def _no_discrepancy(stack: ExitStack) -> None:
    """Nor in the nominal fit, which then is neither read from the cache nor kept there: its key
    does not hold the part."""

    def converged(*given):
        return nominal_fit.converged(*given, seen=discrepancy.MODELLED)

    stack.enter_context(patch.object(discrepancy, "MODELLED", ()))
    stack.enter_context(patch.object(nominal_cache, "converged", converged))
    _learned_anew(stack)


def _no_robust_weights(stack: ExitStack) -> None:
    def plain(square, kept):
        return np.where(kept, 1.0, 0.0)

    for module in (campaign_characteristics, as_it_stands):
        stack.enter_context(patch.object(module, "robust_weights", plain))
    _learned_anew(stack)


def _learned_anew(stack: ExitStack) -> None:
    """What is kept in the cache was learned with the part."""

    def learned(*given):
        return campaign_characteristics.characteristics(*given)

    stack.enter_context(patch.object(nominal_cache, "characteristics", learned))


# Parts of the nominal fit, which is before the decision: replaced where they stand
ESTIMATES: Mapping[str, Callable[[ExitStack], None]] = {
    "discrepancy": _no_discrepancy,
    "robust-weights": _no_robust_weights,
}


def main(arguments: Sequence[str] | None = None) -> int:
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given and given[0] == WHOLE:
        one_search.diagnose(given[1:], AFTER_SEARCH)
    if given and given[0] in PARTS:
        with ExitStack() as stack:
            if given[0] in ESTIMATES:
                ESTIMATES[given[0]](stack)
            sys.argv = ["shiplog", *given[1:]]
            cli.main(PARTS[given[0]])
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
