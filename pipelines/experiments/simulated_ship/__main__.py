"""Write logs of the known ship.

python -m pipelines.experiments.simulated_ship FOLDER
    the sample logs into that folder, such as sample_logs
python -m pipelines.experiments.simulated_ship table trips.csv
    some trips as one table, for the tutorial
python -m pipelines.experiments.simulated_ship case SEED FOLDER --key KEY
    a blind case into that folder, and what is hidden in it into the file KEY, elsewhere
"""

from __future__ import annotations

import argparse
import sys

from pipelines.experiments.simulated_ship import cases
from pipelines.experiments.simulated_ship.sample_logs import write_sample_logs
from pipelines.experiments.simulated_ship.trips import write_trips

PROGRAM = "python -m pipelines.experiments.simulated_ship"


def main(arguments: list[str]) -> None:
    if arguments[:1] == ["case"]:
        _case(arguments[1:])
        return
    if arguments[:1] == ["table"] and len(arguments) == 2:
        write_trips(arguments[1])
        return
    parser = argparse.ArgumentParser(
        prog=PROGRAM, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", help="where the sample logs go, such as sample_logs")
    write_sample_logs(parser.parse_args(arguments).folder)


def _case(arguments: list[str]) -> None:
    known = ", ".join((*cases.CATALOGUE, *cases.DEVICES, *cases.OUTSIDE))
    parser = argparse.ArgumentParser(prog=f"{PROGRAM} case", epilog=f"Causes: none, {known}.")
    parser.add_argument("seed", type=int)
    parser.add_argument("folder", help="where nominal_1.mcap to trial_6.mcap go")
    parser.add_argument("--key", required=True, help="the file that says what is hidden")
    parser.add_argument("--cause", help="hide this and nothing else; two as current+fouling")
    parser.add_argument("--size", type=float, help="1 is realistic; drawn unless given")
    parser.add_argument("--seconds", type=int, default=7000, choices=sorted(cases.DURATIONS))
    given = parser.parse_args(arguments)
    try:
        case = cases.draw(given.seed, cause=given.cause, size=given.size, seconds=given.seconds)
        cases.write(case, given.folder, given.key)
    except (ValueError, FileExistsError) as error:
        parser.error(str(error))


if __name__ == "__main__":
    main(sys.argv[1:])
