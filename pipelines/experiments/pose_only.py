"""Models and verdicts from position and heading alone, next to those from all sensors.

    python -m pipelines.experiments.pose_only SAMPLE_LOGS FRT-DS-ESSO --out pose [--markdown PATH]

Of two ships, the sample logs' and the 3 m Esso Osaka, each log is ingested twice: as it is, and
without velocity and yaw rate. Both models are scored on the windows of all sensors, so that the
tests are the same. A loss of thrust is hidden in both: the simulated ship sails two more voyages
with a fifth of its thrust lost; of the measured one the revolutions of the tests, and of turns that
were held back for it, are logged as higher than they were: a profile with another `sign` does that.

FRT-DS-ESSO (NAOE-5thLab, CC BY-NC 4.0) is not shipped: give the folder with its `runs.csv`.
"""

from __future__ import annotations

import argparse
import json
import logging
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import resources
from pathlib import Path

import numpy as np
import tomli_w

from pipelines.experiments.esso_osaka import published_split
from pipelines.experiments.extrapolation import physics
from pipelines.experiments.simulated_ship.sensors import write_voyage
from pipelines.experiments.simulated_ship.ship import Effects
from pipelines.experiments.simulated_ship.voyage import sail
from pipelines.experiments.simulated_ship.weather import Wind
from shiplog.commands.convert import convert
from shiplog.commands.diagnose import diagnose_run
from shiplog.commands.evaluate import evaluate_runs
from shiplog.commands.prepare import expand, ingest_logs
from shiplog.nomenclature.numbers import figure
from shiplog.report.evaluation import tables
from shiplog.ship_profile import file as profiles
from shiplog.simulation import scoring
from shiplog.training.runs import load_model
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.split import plan
from shiplog.voyages.windows.split_settings import Split

ALL, POSE = "all sensors", "pose only"
DERIVED = ("velocity", "yaw_rate")  # sections of a profile that a pose-only ship lacks
SEED = 91_300
HIDDEN = {  # of the simulated ship: seconds, start, wind
    "hidden_1": (900.0, datetime(2026, 4, 21, 6, 0, tzinfo=UTC), Wind(2.0, 1.2)),
    "hidden_2": (900.0, datetime(2026, 4, 21, 7, 0, tzinfo=UTC), Wind(2.4, -1.0)),
}
LOST = 0.20  # of the simulated ship's thrust
REVOLUTIONS = 1.25  # logged over true, of the measured ship's trial
HELD_BACK = "turn_14-Oct-2020"  # turns of one day, which join the tests in that trial
SAMPLE_SPLIT = Split(
    training=("voyage_1", "voyage_2", "voyage_3", "voyage_4"), validation=("voyage_5",),
    test=("voyage_5", "voyage_6"), chosen_by="the experiment",
)  # fmt: skip
HEAD = ("ship", "sensors", "L on the tests", "of all sensors'", "samples inside the 90 % band",
        "verdict", "thrust lost", "hidden")  # fmt: skip


@dataclass(frozen=True)
class Campaign:
    """A ship's logs: of the nominal voyages, and of those in which thrust is hidden.

    profile  shipped one's name; `shown` of the hidden logs: propeller revolutions over true ones
    """

    ship: str
    profile: str
    nominal: Sequence[Path]
    hidden: Sequence[Path]
    split: Split
    trial: tuple[str, ...]
    lost: str
    shown: float = 1.0


def variant(name: str, path: Path, pose: bool, shown: float = 1.0) -> Path:
    """A shipped profile as a file: without velocities where only the pose is read, and with a
    factor on the propeller's revolutions."""
    text = (resources.files("shiplog") / "profiles" / f"{name}.toml").read_text("utf-8")
    content = tomllib.loads(text)
    for sensor in DERIVED if pose else ():
        content["sensors"].pop(sensor, None)
    for one in content["actuators"]:
        if one["kind"] == "propeller" and shown != 1.0:
            one["sign"] = shown
            one["limits"] = [shown * limit for limit in one["limits"]]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(tomli_w.dumps(content), encoding="utf-8")
    return path


def simulated(logs: Path, out: Path) -> Campaign:
    """The sample logs, and two voyages with less thrust."""
    for number, (name, (seconds, start, wind)) in enumerate(HIDDEN.items()):
        if not (out / f"{name}.mcap").exists():
            out.mkdir(parents=True, exist_ok=True)
            effects = Effects(thrust_loss=LOST)
            voyage = sail(seconds, seed=SEED + number, wind=wind, effects=effects)
            write_voyage(out / f"{name}.mcap", voyage, seed=SEED + number, start=start)
    nominal = sorted(logs.glob("voyage_*.mcap"))
    return Campaign(
        "sample logs", "esso-vectwin", nominal, sorted(out.glob("*.mcap")), SAMPLE_SPLIT,
        tuple(HIDDEN), f"{LOST:.2f}",
    )  # fmt: skip


def measured(folder: Path, out: Path) -> Campaign:
    """The Esso Osaka's tables as logs, and its published split without the turns of one day."""
    published = published_split(folder)
    held = tuple(n for n in published.training if n.startswith(HELD_BACK))
    training = tuple(n for n in published.training if n not in held)
    split = published.model_copy(update={"training": training})
    if not out.exists():
        convert(sorted(folder.glob("*/*.parquet")), profiles.load("esso-osaka"), out)
    logs = {path.stem: path for path in expand([out])}
    least = 1.0 - REVOLUTIONS**-2.0  # at rest; at speed less, since K_T falls with J
    return Campaign(
        "Esso Osaka, 3 m, measured", "esso-osaka",
        [logs[n] for n in (*published.training, *split.validation, *split.test)],
        [logs[n] for n in (*split.test, *held)], split, (*split.test, *held),
        f"up to {least:.2f} (revolutions logged {REVOLUTIONS - 1.0:.0%} too high)", REVOLUTIONS,
    )  # fmt: skip


def rows(one: Campaign, out: Path) -> list[tuple[object, ...]]:
    """Of both ways to ingest one campaign, a row of the table."""
    found: dict[str, tuple[object, ...]] = {}
    base = 0.0
    whole = Store(out / "all-sensors" / "store")
    for what in (ALL, POSE):
        folder = out / what.replace(" ", "-")
        store, trial = Store(folder / "store"), Store(folder / "trial")
        pose = what == POSE
        profile = variant(one.profile, folder / f"{one.profile}.toml", pose)
        ingest_logs(one.nominal, str(profile), store)
        shown = variant(one.profile, folder / "shown" / f"{one.profile}.toml", pose, one.shown)
        ingest_logs([p for p in one.nominal if p not in one.hidden], str(profile), trial)
        ingest_logs(one.hidden, str(shown), trial)
        run = physics(store, folder / "mmg", one.split)
        if not (folder / "diagnosis" / "verdict.json").exists():
            diagnose_run(run, trial, one.trial, folder / "diagnosis")
        loss = loss_on(run, whole, one.split.test)
        base = base or loss
        inside = evaluate_runs([run], store, one.split.test)[run.name].band_90
        verdict = json.loads((folder / "diagnosis" / "verdict.json").read_text("utf-8"))
        found[what] = (
            one.ship, what, figure(loss, 3), f"{loss / base:.2f}", _span(inside.values()),
            ", ".join(c["name"] for c in verdict["causes"]) or verdict["verdict"],
            _thrust(verdict), one.lost,
        )  # fmt: skip
        logging.info("%s", found[what])
    return list(found.values())


def loss_on(run: Path, store: Store, names: Sequence[str]) -> float:
    """Mean L of a run on the windows of these voyages as this store has them."""
    opened = load_model.load(run)
    profile = store.profile(names)
    seconds = store.seconds(names, profile)
    planned = plan(seconds, "ref", opened.config.window)
    cut = windows.cut(
        seconds, planned, opened.config.window, profile.actuator_names, profile.wind_names
    )  # fmt: skip
    every = [scoring.score(model, cut).errors["loss"] for model in opened.models().values()]
    return float(np.mean(np.concatenate(every)))


def _span(shares: Iterable[float]) -> str:
    found = sorted(shares)
    return f"{found[0]:.0%} to {found[-1]:.0%}" if found else "-"


def _thrust(verdict: dict) -> str:
    """What a verdict says of the thrust that is lost, with its 90 % interval."""
    for cause in verdict["causes"]:
        if cause["name"] == "thrust_loss":
            factor = cause["parameters"]["factor"]
            low, high = sorted(1.0 - factor[key] for key in ("low", "high"))
            return f"{1.0 - factor['value']:.3f} ({low:.3f} to {high:.3f})"
    return "-"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("logs", type=Path)
    parser.add_argument("esso", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--markdown", type=Path)
    given = parser.parse_args()
    logging.basicConfig(format="%(message)s", level=logging.INFO)
    campaigns = {
        "sample": simulated(given.logs, given.out / "hidden"),
        "esso": measured(given.esso, given.out / "esso-logs"),
    }
    found = [row for name, one in campaigns.items() for row in rows(one, given.out / name)]
    text = tables.table(HEAD, found)
    print(text)
    if given.markdown is not None:
        given.markdown.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
