"""`python -m pipelines.known_ship sample_logs`: write the sample logs into that folder."""

from __future__ import annotations

import argparse

from pipelines.known_ship.sample_logs import write_sample_logs


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m pipelines.known_ship", description=__doc__)
    parser.add_argument("folder", help="where the logs go, such as sample_logs")
    write_sample_logs(parser.parse_args().folder)


if __name__ == "__main__":
    main()
