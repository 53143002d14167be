"""Profiles with one wrong unit, sign or place, on the sample logs: which are seen, and by what.

    python -m pipelines.experiments.wrong_profiles
    python -m pipelines.experiments.wrong_profiles --diagnose --out OUT --only "wind"
    python -m pipelines.experiments.wrong_profiles --diagnose \
        --markdown docs/evidence/wrong_profiles.md

Each is tried in three ways: in both campaigns, in the trial only, in the profile of one voyage.
Without --diagnose the voyages are ingested and nothing is trained; with it, a model of the right
profile also judges season 3, in which nothing is hidden, read through the wrong one.

    sensors        the sensors contradict each other
    plausibility   the profile, or the physics of ships, excludes it
    undetermined   the record is as likely with it as without
"""

from __future__ import annotations

import argparse
import logging
import sys
from pathlib import Path

from pipelines.experiments.wrong_profiles import diagnosed, page, seen
from pipelines.experiments.wrong_profiles.profiles import WRONG


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", default="", help="names that hold this")
    parser.add_argument("--diagnose", action="store_true", help="also a verdict on season 3")
    parser.add_argument("--out", type=Path, default=Path("wrong_profiles"))
    parser.add_argument("--markdown", type=Path, help="the page to write")
    given = parser.parse_args()
    logging.disable(logging.WARNING)
    chosen = [wrong for wrong in WRONG if given.only in wrong.name]

    def reach(name: str) -> None:
        print(name, file=sys.stderr, flush=True)

    verdicts = diagnosed.every(chosen, given.out, reach) if given.diagnose else {}
    text = page.page(chosen, seen.every(chosen, reach), verdicts)
    if given.markdown is None:
        print(text)
    else:
        given.markdown.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
