"""What shiplog says of measured ships: the figures of docs/evidence.

    python -m pipelines.experiments.findings sensors     FRT-DS-ESSO --out findings
    python -m pipelines.experiments.findings published   FRT-DS-ESSO --out findings
    python -m pipelines.experiments.findings refitted    FRT-DS-ESSO --out findings
    python -m pipelines.experiments.findings forces      FRT-DS-ESSO --out findings
    python -m pipelines.experiments.findings wind        FRT-DS-ESSO --out findings
    python -m pipelines.experiments.findings faults      FRT-DS-ESSO --out findings
    python -m pipelines.experiments.findings faults-other OTHER-SHIP --out findings
    python -m pipelines.experiments.findings actuators-blueboat BLUEBOAT --out findings
    python -m pipelines.experiments.findings actuators-kvlcc2   KVLCC2   --out findings
    python -m pipelines.experiments.findings milliampere MILLIAMPERE --out findings
    python -m pipelines.experiments.findings kvlcc2      KVLCC2      --out findings

None of these data are shipped: give the folder that holds them. What stands in --out already is not
done again. Minutes each.
"""

from __future__ import annotations

import argparse
import logging
from collections.abc import Callable
from pathlib import Path

from pipelines.experiments.findings import (
    actuator_faults,
    esso_osaka,
    faults,
    kvlcc2,
    milliampere,
)

FINDINGS: dict[str, Callable[[Path, Path], str]] = {
    "sensors": esso_osaka.sensors, "published": esso_osaka.published,
    "refitted": esso_osaka.refitted, "forces": esso_osaka.forces, "wind": esso_osaka.wind,
    "faults": faults.esso_osaka, "faults-other": faults.other_ship,
    "actuators-blueboat": actuator_faults.blueboat, "actuators-kvlcc2": actuator_faults.kvlcc2,
    "milliampere": milliampere.milliampere, "kvlcc2": kvlcc2.kvlcc2,
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=FINDINGS)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    logging.basicConfig(format="%(message)s", level=logging.INFO)
    print(FINDINGS[arguments.what](arguments.folder, arguments.out))


if __name__ == "__main__":
    main()
