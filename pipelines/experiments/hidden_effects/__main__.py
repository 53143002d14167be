"""Hide, diagnose, score.

python -m pipelines.experiments.hidden_effects fixed --out DIR
    twelve seeds; what is hidden is drawn by the seed
python -m pipelines.experiments.hidden_effects brief --out DIR
    the same in campaigns of 3000 s
python -m pipelines.experiments.hidden_effects nightly --out DIR [--count 200] [--first-seed 30000]
    the same with other seeds; shift the block monthly, and never tune on it
python -m pipelines.experiments.hidden_effects network --out DIR [--count 15] [--first-seed 25000]
    the paper's network, trained on the very voyages in question: what it cannot absorb is to be
    named, and what it has absorbed never
python -m pipelines.experiments.hidden_effects goals --out DIR [--count 20] [--first-seed 20000]
    count cases for each row of the goals' table; multiples of 21 meet every cause equally often
python -m pipelines.experiments.hidden_effects abroad --out DIR [--count 100] [--first-seed 70000]
    ships whose equations are not the home ship's, from pipelines.experiments.other_families
python -m pipelines.experiments.hidden_effects devices --out DIR [--count 20] [--first-seed 64000]
python -m pipelines.experiments.hidden_effects devices-abroad --out DIR [--count 120]
    [--first-seed 74000]
    the same two with actuators, lines, tows and contact as a third of the cases and more; abroad
    with two further ships, which heel
    each with --rivals: what simpler methods say of the same trials, too; of cases that were run
    with --keep before, give the command again
python -m pipelines.experiments.hidden_effects remake DIR [--share]
    logs, stores and models of cases whose answers alone are here, such as those that were unpacked
python -m pipelines.experiments.hidden_effects replay DIR [--out NEW] [--rivals] [--every N]
    [--first N] [--shiplog COMMAND [--called NAME]] [--whole [--share]]
    the kept cases of DIR diagnosed again by the program as it is now, into another folder; with
    --whole from their logs on, for a program that cannot read their stores and models
python -m pipelines.experiments.hidden_effects score DIR
    the tables again, of what is there by now
python -m pipelines.experiments.hidden_effects scores DIR [DIR ...] [--markdown PATH]
    the pages of validation: goals, misses, the scores of all methods, home and abroad apart
python -m pipelines.experiments.hidden_effects pack DIR [DIR ...] --into FILE.tar.xz
    their answers and keys in one file, which `scores` takes as well as folders; unpacked with
    `tar -xf`, a test goes on where it was

Interrupted, give the same command again and it goes on; with a larger --count it grows. Exit
code 2: verdicts of several programs, which no table holds; 3: a case has no verdict; 4: less than
--least asks for.
"""

from __future__ import annotations

import argparse
import logging
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from pipelines.experiments.hidden_effects import (
    archive,
    plan,
    remake,
    replay,
    run,
    score,
    score_tables,
    suites,
    validation,
)
from pipelines.experiments.hidden_effects.run import Settings
from pipelines.experiments.hidden_effects.score import Score
from pipelines.experiments.hidden_effects.validation import Mixed
from shiplog.exceptions import ShiplogError


def main(arguments: Sequence[str] | None = None) -> int:
    given = _parser().parse_args(arguments)
    logging.basicConfig(format="%(message)s", stream=sys.stderr, level=logging.INFO)
    try:
        if given.what == "scores":
            return _scores(given)
        if given.what == "pack":
            print(archive.pack(given.out, given.into))
            return 0
        if given.what != "score":
            _run(given)
        found = score.read(given.out)
    except Mixed as error:
        print(error, file=sys.stderr)
        return 2
    except ShiplogError as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("stopped; what was finished is kept", file=sys.stderr)
        return 130
    print(score_tables.text(found))
    if found.unmade or any(a.word == run.FAILED for a in found.answers):
        return 3
    return _short_of(found, given.least)


def _short_of(found: Score, least: int) -> int:
    """4 where fewer are right than are asked for, or one is misnamed."""
    right, wrong = (sum(getattr(a, how) for a in found.answers) for how in ("right", "misnamed"))
    if not least or (right >= least and not wrong):
        return 0
    print(f"{right} right and {wrong} misnamed; at least {least} and none were asked for")
    return 4


def _scores(given: argparse.Namespace) -> int:
    with archive.opened(given.out) as folders:
        found = [score.read(folder) for folder in folders]
        page = validation.page(found, given.markdown, given.machine)
    if given.markdown is None:
        print(page.text)
    else:
        page.write(given.markdown)
    return 0


def _run(given: argparse.Namespace) -> None:
    command = tuple(shlex.split(given.shiplog)) if given.shiplog else Settings().shiplog
    settings = Settings(
        jobs=given.jobs, keep=given.keep, share=given.share, rivals=given.rivals,
        oracle=given.oracle, limit=given.limit, shiplog=command,
        called=given.called,
    )  # fmt: skip
    if given.what == "replay":
        given.out = given.out or replay.folder_of(given.source)
        replay.replay(given.source, given.out, settings, given.every, given.first, given.whole)
        return
    if given.what == "remake":
        remake.remake(given.out, settings)
        return
    planned = suites.plan(given.what, given.first_seed, given.count)
    run.run(given.out, plan.save(given.out, planned), settings)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m pipelines.experiments.hidden_effects",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(dest="what", required=True)
    for name, (first, count) in suites.SUITES.items():
        suite = commands.add_parser(name, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
        suite.add_argument("--out", type=Path, required=True, help="one folder, one test")
        _how(suite)
        suite.add_argument("--oracle", action="store_true", help="what the truth would gain, too")
        suite.set_defaults(first_seed=None, count=None)
        if name not in ("fixed", "brief"):
            suite.add_argument("--first-seed", type=int, default=first, help="of the block")
        if name != "fixed":
            suite.add_argument(
                "--count", type=plan.positive, default=count, help="cases, or a row's"
            )
    made = commands.add_parser("remake", help="logs, stores and models of unpacked cases")
    made.add_argument("out", type=Path, metavar="DIR")
    _processes(made)
    made.set_defaults(keep=True, rivals=False, oracle=False)
    again = commands.add_parser("replay", help="kept cases, diagnosed again")
    again.add_argument("source", type=Path, metavar="DIR", help="with cases run with --keep")
    again.add_argument("--out", type=Path, help="another folder; next to DIR unless given")
    again.add_argument("--every", type=plan.positive, default=1, help="one case of so many")
    again.add_argument("--first", type=plan.positive, metavar="N", help="of these, so many")
    again.add_argument("--whole", action="store_true", help="from the logs on")
    _how(again)
    again.set_defaults(oracle=False)
    scored = commands.add_parser("score", help="the tables of what is there by now")
    scored.add_argument("out", type=Path)
    page = commands.add_parser("scores", help="the validation page of all cases found")
    page.add_argument("out", type=Path, nargs="+", metavar="DIR", help="or a packed file")
    page.add_argument(
        "--markdown", type=Path, metavar="PATH", help="write it there, with its picture"
    )
    page.add_argument("--machine", default=validation.MACHINE, help="on which the cases were run")
    packed = commands.add_parser("pack", help="answers and keys in one file")
    packed.add_argument("out", type=Path, nargs="+", metavar="DIR")
    packed.add_argument("--into", type=Path, required=True, metavar="FILE.tar.xz")
    for one in (one for n, one in commands.choices.items() if n not in ("scores", "pack")):
        one.add_argument("--least", type=int, default=0, metavar="N", help="exit code 4 unless N "
                         "are right and none is misnamed")  # fmt: skip
    return parser


def _how(command: argparse.ArgumentParser) -> None:
    """What a suite and a replay have in common."""
    _processes(command)
    command.add_argument("--keep", action="store_true", help="keep logs, store, base, report")
    command.add_argument("--rivals", action="store_true", help="ask simpler methods, too")


def _processes(command: argparse.ArgumentParser) -> None:
    """What all that run the steps of a case have in common."""
    command.add_argument("--jobs", type=plan.positive, default=1, help="ships at a time")
    command.add_argument("--share", action="store_true", help="train once a ship, not once a case")
    command.add_argument("--limit", type=float, default=3600.0, help="seconds for one step")
    command.add_argument("--shiplog", metavar="COMMAND", help="instead of this source's")
    command.add_argument("--called", metavar="NAME", default="", help="what pages call that one")


if __name__ == "__main__":
    sys.exit(main())
