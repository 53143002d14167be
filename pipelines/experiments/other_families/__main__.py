"""Write a blind case of a ship of another family.

python -m pipelines.experiments.other_families case SEED FOLDER --key KEY
    nominal_1.mcap to trial_5.mcap and ship.toml into FOLDER, what is hidden into the file KEY
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from pipelines.experiments.other_families import cases

PROGRAM = "python -m pipelines.experiments.other_families"


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog=PROGRAM, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="what", required=True)
    known = ", ".join((*cases.CATALOGUE, *cases.DEVICES, *cases.OUTSIDE))
    case = commands.add_parser(
        "case", help="one blind case",
        epilog=f"Causes: none, {known}; a ship offers those for which it has the device.",
    )  # fmt: skip
    case.add_argument("seed", type=int)
    case.add_argument("folder", help="where the logs and ship.toml go")
    case.add_argument("--key", required=True, help="the file that says what is hidden")
    case.add_argument("--family", choices=tuple(cases.FAMILIES), help="drawn unless given")
    case.add_argument("--cause", help="hide this and nothing else; two as current+fouling")
    case.add_argument("--size", type=float, help="1 is realistic; drawn unless given")
    case.add_argument(
        "--seconds", type=float,
        help="of the trial; 7000, or 170 L/U where that is more, unless given",
    )  # fmt: skip
    given = parser.parse_args(arguments)
    try:
        drawn = cases.draw(
            given.seed, family=given.family, cause=given.cause, size=given.size,
            seconds=given.seconds,
        )  # fmt: skip
        cases.write(drawn, given.folder, given.key)
    except (ValueError, FileExistsError) as error:
        case.error(str(error))


if __name__ == "__main__":
    main(sys.argv[1:])
