"""What the page of a verdict costs, in a process that has what `diagnose` has loaded.

    python -m pipelines.experiments.benchmarks.report_page DIAGNOSIS [...]

Of each folder of `shiplog diagnose`: processor time of reading its tables, drawing and writing, the
least of three; the memory that it takes more; the size of the page. The first figure of the first
folder has matplotlib's imports in it, the others have not.
"""

from __future__ import annotations

import importlib
import resource
import sys
import tempfile
import time
from pathlib import Path

from pipelines.experiments.benchmarks import machine

ROUNDS = 3


def page_of(diagnosis: Path, to: Path) -> tuple[float, int]:
    """Processor time [s] and size [bytes] of one page."""
    began = time.process_time()
    from shiplog.report.page import html
    from shiplog.report.page.diagnosis import page

    made = html.write(page.of_folder(diagnosis), to)
    return time.process_time() - began, made.stat().st_size


def main(folders: list[Path]) -> None:
    print(machine.processor())
    importlib.import_module("shiplog.commands.diagnose")  # what a diagnosis has loaded already
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with tempfile.TemporaryDirectory() as temporary:
        for folder in folders:
            rounds = [page_of(folder, Path(temporary) / "page.html") for _ in range(ROUNDS)]
            first, least = rounds[0][0], min(seconds for seconds, _ in rounds)
            more = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
            print(
                f"{folder.name}: {first:.2f} s for the first, {least:.2f} s for the least of "
                f"{ROUNDS}; {rounds[0][1] / 1e3:.0f} kB; {more:.0f} MB more"
            )


if __name__ == "__main__":
    main([Path(given) for given in sys.argv[1:]])
