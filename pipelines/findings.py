"""What shiplog says of measured ships: the figures of .docs/findings.md.

    python -m pipelines.findings sensors     FRT-DS-ESSO --out findings
    python -m pipelines.findings published   FRT-DS-ESSO --out findings
    python -m pipelines.findings direct      FRT-DS-ESSO --out findings
    python -m pipelines.findings refitted    FRT-DS-ESSO --out findings
    python -m pipelines.findings wind        FRT-DS-ESSO --out findings
    python -m pipelines.findings milliampere MILLIAMPERE --out findings
    python -m pipelines.findings kvlcc2      KVLCC2      --out findings

None of these data are shipped: give the folder that holds them. What stands in --out already is not
done again. Minutes each.
"""

from __future__ import annotations

import argparse
import json
import logging
import time
import tomllib
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path

import numpy as np
import polars as pl
import tomli_w
from scipy.signal import lfilter

from pipelines import azimuths
from pipelines.convert import convert
from pipelines.diagnose import diagnose_run, setting_of
from pipelines.esso_osaka import TWIN, trials_store
from pipelines.evaluate import evaluate_runs
from pipelines.extrapolation import physics
from pipelines.identify import identify_run
from pipelines.prepare import expand, ingest_logs, seconds
from pipelines.split import plan
from shiplog import midship, parity, record, report, runs, table, windows
from shiplog import profile as profiles
from shiplog.causes import CATALOGUE
from shiplog.config import Config, Split
from shiplog.direct import MOST, Search, search_of
from shiplog.parity import Estimate
from shiplog.store import Store

log = logging.getLogger(__name__)

# --- the 3 m Esso Osaka ---------------------------------------------------------------------------

MANOEUVRES = ("berthing", "random", "turn", "zigzag")
COLUMNS = {  # kind and channel of an estimate → its column
    ("clock_offset", "yaw_rate"): "yaw rate late, s",
    ("yaw_rate_scale", "yaw_rate"): "yaw rate scale",
    ("clock_offset", "velocity"): "velocity late, s",
}


def sensors(folder: Path, out: Path) -> str:
    """A row a voyage: what its instruments say of each other, in brackets where it may be none."""
    store = trials_store(folder, out)
    said = {name: _estimates(store, name) for name in trials(store)}
    rows = [
        (name, *(_cell(found.get(key)) for key in COLUMNS)) for name, found in said.items()
    ]  # fmt: skip
    lines = [report.table(("voyage", *COLUMNS.values()), rows), ""]
    for key, column in COLUMNS.items():
        for kind in MANOEUVRES:
            values = [f[key].value for n, f in said.items() if n.startswith(kind) and key in f]
            if values:
                lines.append(
                    f"{column}, {kind}: {min(values):.3f} to {max(values):.3f} in {len(values)}"
                )
    lines += [
        f"also {name}: {e.kind} of {e.channel} {_cell(e)} {e.unit}"
        for name, found in said.items()
        for key, e in found.items()
        if e.notable and key not in COLUMNS
    ]
    return "\n".join(lines)


def trials(store: Store, *patterns: str) -> list[str]:
    """Voyages without the one that is the beginning of another."""
    return [n for n in store.select(list(patterns) or None) if n != TWIN]


def _estimates(store: Store, name: str) -> dict[tuple[str, str], Estimate]:
    found = parity.estimates(store.tables([name])[0].collect(), store.profile([name]))
    return {(e.kind, e.channel): e for e in found}


def _cell(e: Estimate | None) -> str:
    """Value and 90 % interval; in brackets where it is not said, since it may be none."""
    if e is None:
        return "-"
    digits = 2 if e.unit == "s" else 3
    text = f"{e.value:.{digits}f} ({e.low:.{digits}f} to {e.high:.{digits}f})"
    return text if e.notable else f"[{text}]"


def published(folder: Path, out: Path) -> str:
    """The published MMG against all voyages, and against the random ones alone."""
    store = trials_store(folder, out)
    run = physics(store, out / "published", _split(store), fit=False)
    return "\n\n".join(
        diagnosed(run, store, trials(store, *patterns), out / f"published-{what}", what)
        for what, patterns in (("all", ()), ("random", ("random_*",)))
    )


def refitted(folder: Path, out: Path) -> str:
    """The model identified from the very voyages that are then diagnosed."""
    store = trials_store(folder, out)
    run = physics(store, out / "refitted", _split(store))
    return diagnosed(run, store, trials(store, "random_*"), out / "refitted-random", "random")


def _split(store: Store) -> Split:
    return Split(training=tuple(trials(store)), validation=())


def wind(folder: Path, out: Path) -> str:
    """The published MMG without its wind: no wind known at all, then offered as an input."""
    store = trials_store(folder, out)
    calm = Store(out / "calm")
    if not calm.entries():
        path = variant("esso-osaka", out / "esso-calm.toml", _without_wind)
        ingest_logs(expand([out / "logs"]), str(path), calm)
    said = []
    for what, there in (("withheld", calm), ("offered", store)):
        run = out / f"no-wind-{what}"
        if not run.exists():
            off = {"fit": False, "without": ("wind",)}
            config = Config.model_validate({"model": "mmg", "split": _split(there), "physics": off})
            identify_run(config, there, run)
        names = trials(there, "random_*")
        said.append(diagnosed(run, there, names, out / f"no-wind-random-{what}", what))
    return "\n\n".join(said)


def _without_wind(profile: dict) -> None:
    del profile["sensors"]["wind"]


def variant(profile: str, path: Path, edit: Callable[[dict], None]) -> Path:
    """A shipped profile, changed, as a file."""
    shipped = resources.files("shiplog") / "profiles"
    content = tomllib.loads((shipped / f"{profile}.toml").read_text("utf-8"))
    edit(content)
    path.write_text(tomli_w.dumps(content), encoding="utf-8")
    coefficients = shipped / f"{profile}.mmg.toml"
    if coefficients.is_file():
        path.with_suffix(".mmg.toml").write_text(coefficients.read_text("utf-8"), "utf-8")
    return path


# --- how far a few causes could get ---------------------------------------------------------------

SHOWN = 4


def direct(folder: Path, out: Path) -> str:
    """Each cause, and each beside the best, fitted to the windows' L itself: how far could naming
    get, with no evidence, no prior and no unrest in the way?"""
    store = trials_store(folder, out)
    run = physics(store, out / "published", _split(store), fit=False)
    return "\n\n".join(
        f"{what}:\n\n{_direct(_search(run, store, trials(store, *patterns)))}"
        for what, patterns in (("all", ()), ("random", ("random_*",)))
    )


def _direct(search: Search) -> str:
    every = np.ones(len(search.cut), dtype=bool)
    found: dict[tuple[str, ...], np.ndarray] = {}
    for label in search.at:
        found[(label,)] = search.fit([label], np.zeros(len(search.at[label])), every)
    loss = {labels: search.loss(labels, x).mean() for labels, x in found.items()}
    first = sorted(loss, key=lambda labels: loss[labels])[:2]
    for one in first:
        for label in search.at:
            labels = tuple(sorted((*one, label)))
            if label in one or labels in found or len(search.where(labels)) > MOST:
                continue
            start = np.concatenate([found[one] if n in one else found[(n,)] for n in labels])
            found[labels] = search.fit(labels, start, every)
            loss[labels] = search.loss(labels, found[labels]).mean()
    start = search.loss((), np.zeros(0)).mean()
    rows = []
    for count in (1, 2):
        best = sorted((n for n in loss if len(n) == count), key=lambda n: loss[n])[:SHOWN]
        for labels in best:
            held = search.held_out(labels, found[labels]).mean()
            rows.append(
                (" + ".join(labels), _numbers(search, labels, found[labels]), f"{loss[labels]:.0f}",
                 f"{held:.0f}", f"{held / start:.3f}")
            )  # fmt: skip
    head = ("causes", "numbers, SI", "L", "L held out", "of published")
    return f"Published: L {start:.0f}, {len(search.cut)} windows.\n\n{report.table(head, rows)}"


def _numbers(search: Search, labels: Sequence[str], x: np.ndarray) -> str:
    return ", ".join(f"{v:+.2f}" for v in x * search.size[search.where(labels)])


def _search(run_path: Path, store: Store, names: Sequence[str]) -> Search:
    run = runs.load(run_path)
    profile = store.profile(names)
    recorded = record.read([t.collect() for t in store.tables(names)], names, profile)
    setting = setting_of(run, recorded, recorded)
    causes = [c.on(setting) for c in CATALOGUE if c.missing(setting) is None]
    rows = table.with_elapsed(seconds(store, names, profile))
    cut = windows.cut(
        rows, plan(rows, "ref", run.config.window), run.config.window, profile.actuator_names,
        profile.wind_names,
    )  # fmt: skip
    return search_of(run.extended(run.config.seeds[0], recorded), causes, setting, cut)


# --- milliAmpere ----------------------------------------------------------------------------------

UNITS = (1, 2, 3, 4)
FILES = ("actuator_ref_{}.parquet", "actuators__actuator_{}__azimuth_angle.parquet")
STEP = 0.1  # s
OBEYED = 30.0  # deg: an order farther than this from where the unit stands is another branch
DELAYS, LAGS = np.arange(0.0, 1.51, 0.1), (0.02, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.2, 1.6, 2.4)


def milliampere(folder: Path, out: Path) -> str:
    """Ordered against measured azimuths, by themselves; then what the motion says of the orders."""
    rows = []
    voyages = sorted(p.name for p in folder.iterdir() if p.is_dir())
    for voyage in voyages:
        for unit in UNITS:
            rows.append((voyage, unit, *_follows(folder / voyage, unit)))
    head = (
        "voyage", "unit", "used", "as ordered, deg", "delay alone, s", "deg", "dead time, s",
        "lag, s", "deg",
    )  # fmt: skip
    return f"{report.table(head, rows)}\n\n{_from_motion(folder, out, voyages)}"


def _follows(folder: Path, unit: int) -> tuple[str, str, str, str, str, str, str]:
    """Share of the time used; RMS of measured less ordered; the best delay; the best dead time
    with a lag of the first order. Only where the order stays near where the unit stands."""
    order, stood = (pl.read_parquet(folder / name.format(unit)) for name in FILES)
    begin = max(order["log_time_ns"][0], stood["log_time_ns"][0])
    end = min(order["log_time_ns"][-1], stood["log_time_ns"][-1])
    time_ = np.arange(0.0, (end - begin) * 1e-9, STEP)
    ordered_at, stood_at = ((t["log_time_ns"].to_numpy() - begin) * 1e-9 for t in (order, stood))
    measured = np.unwrap(np.radians(stood["data"].to_numpy()))
    measured = np.interp(time_, stood_at, measured)
    held = np.clip(np.searchsorted(ordered_at, time_, side="right") - 1, 0, None)
    ordered = np.radians(order["angle_reference"].to_numpy().astype(float))[held]
    ordered = measured + midship.wrap(ordered - measured)
    near = np.abs(ordered - measured) < np.radians(OBEYED)
    reach = int(4.0 / STEP)
    good = np.convolve(near, np.ones(reach), "full")[: len(near)] > reach - 0.5

    def rms(value: np.ndarray) -> float:
        return float(np.degrees(np.sqrt(np.mean((value - measured)[good] ** 2))))

    late = {d: rms(_late(ordered, d)) for d in np.arange(0.0, 3.01, 0.1)}
    both = {(d, t): rms(_lagged(_late(ordered, d), t)) for d in DELAYS for t in LAGS}
    delay = min(late, key=lambda d: late[d])
    dead, lag = min(both, key=lambda k: both[k])
    return (
        f"{good.mean():.0%}", f"{rms(ordered):.2f}", f"{delay:.1f}", f"{late[delay]:.2f}",
        f"{dead:.1f}", f"{lag:.1f}", f"{both[(dead, lag)]:.2f}",
    )  # fmt: skip


def _late(values: np.ndarray, seconds_: float) -> np.ndarray:
    rows = round(seconds_ / STEP)
    return np.concatenate((np.full(rows, values[0]), values[: len(values) - rows]))


def _lagged(values: np.ndarray, time_: float) -> np.ndarray:
    decay = np.exp(-STEP / time_)
    start = [decay * values[0]]
    return lfilter([1.0 - decay], [1.0, -decay], values, zi=start)[0]


def _from_motion(folder: Path, out: Path, voyages: Sequence[str]) -> str:
    """A model identified with the azimuths as measured, against the same voyages driven by the
    azimuths as ordered: what changed is how they follow."""
    store = Store(out / "milliampere")
    if not store.entries():
        out.mkdir(parents=True, exist_ok=True)
        ordered = variant("milliampere", out / "milliampere-ordered.toml", _as_ordered)
        for name, prefix in (("milliampere", ""), (str(ordered), "ordered_")):
            logs = out / f"milliampere-logs{prefix}"
            made, _ = convert([folder / v for v in voyages], profiles.load(name), logs)
            named = [p.rename(p.with_name(f"{prefix}{p.name}")) for p in made]
            ingest_logs(named, name, store)
    there = [e.name for e in store.entries()]
    measured = tuple(n for n in there if not n.startswith("ordered_"))
    split = Split(training=measured, validation=())
    run = physics(store, out / "milliampere-run", split)
    names = [n for n in there if n.startswith("ordered_")]
    return diagnosed(
        run, store, names, out / "milliampere-ordered", "ordered", (Path(azimuths.__file__),)
    )


def _as_ordered(profile: dict) -> None:
    for actuator in profile["actuators"]:
        if actuator["kind"] == "azimuth":
            unit = actuator["name"].removeprefix("azimuth_")
            actuator |= {"topic": f"/actuator_ref_{unit}", "field": "angle_reference"}


# --- KVLCC2 ---------------------------------------------------------------------------------------

HSVA, MARIN = "hsva_cpmc_zigzag_20hz_model.parquet", "marin_free_fullscale.parquet"
SCALE = 45.7
WINDOW = 50
SPEED, RATE = np.sqrt(SCALE), np.sqrt(SCALE)  # Froude: speeds grow and rates fall by as much
REVERSED = "reversed_"


def kvlcc2(folder: Path, out: Path) -> str:
    """A model identified at HSVA, against MARIN's tests brought to HSVA's scale; then the same with
    MARIN's rudder left in the facility's own sense."""
    store = Store(out / "kvlcc2")
    if not store.entries():
        logs = out / "kvlcc2-logs"
        logs.mkdir(parents=True, exist_ok=True)
        scaled = at_model_scale(pl.read_parquet(folder / MARIN))
        turned = scaled.with_columns(
            pl.format("{}{}", pl.lit(REVERSED), "run_id").alias("run_id"), -pl.col("delta_deg")
        )
        scaled.write_parquet(logs / "marin.parquet")
        turned.write_parquet(logs / "reversed.parquet")
        tables = [folder / HSVA, logs / "marin.parquet", logs / "reversed.parquet"]
        convert(tables, profiles.load("kvlcc2"), logs)
        ingest_logs(expand([logs]), "kvlcc2", store)
    there = [e.name for e in store.entries()]
    hsva = tuple(n for n in there if n.startswith("HSVA"))
    marin = [n for n in there if n.startswith("MARIN")]
    run = out / "kvlcc2-run"
    if not run.exists():
        config = {"model": "mmg", "window": WINDOW, "split": Split(training=hsva, validation=())}
        identify_run(Config.model_validate(config), store, run)
    reversed_ = [n for n in there if n.startswith(REVERSED)]
    return "\n\n".join(
        (
            evaluate_runs([run], store, marin).text(),
            diagnosed(run, store, marin, out / "kvlcc2-marin", "MARIN"),
            diagnosed(run, store, reversed_, out / "kvlcc2-reversed", "rudder reversed"),
        )
    )


def at_model_scale(full: pl.DataFrame) -> pl.DataFrame:
    """MARIN's values, scaled up there, at HSVA's scale by Froude's law, in HSVA's columns."""
    return full.select(
        "run_id",
        pl.col("t_rec_s") / RATE,
        *(pl.col(n) / SCALE for n in ("x0_m", "y0_m")),
        *(pl.col(n) / SPEED for n in ("u_body_mps", "v_body_mps")),
        "psi_deg",
        "delta_deg",
        pl.col("r_degps") * RATE,
        n_rps=pl.col("n_rpm") / 60.0 * RATE,
    ).rename({"t_rec_s": "t_s"})


# --- what a diagnosis said ------------------------------------------------------------------------


def diagnosed(
    run: Path,
    store: Store,
    names: Sequence[str],
    out: Path,
    what: str,
    cause_files: Sequence[Path] = (),
) -> str:
    """The verdict in a few lines, made unless it is there."""
    if not (out / "verdict.json").exists():
        began = time.monotonic()
        diagnose_run(run, store, names, out, cause_files=cause_files)
        log.info("%s: %.0f s", out.name, time.monotonic() - began)
    said = json.loads((out / "verdict.json").read_text("utf-8"))
    lines = [f"## {run.name}, {what}", "", f"{said['verdict']}: {said['sentence']}", ""]
    for cause in said["causes"]:
        lines.append(f"- {cause['name']}: {_parameters(cause['parameters'])}")
    gain = said.get("gain")
    if gain:
        lines.append(
            f"- held out: L {gain['before']:.0f} to {gain['after']:.0f}, "
            f"{gain['reduction']:.0%} less ({gain['low']:.0%} to {gain['high']:.0%}), "
            f"{gain['held_out_windows']} windows"
        )
    lines += [f"- rejected {r['name']}: {r['reason']}" for r in said["rejected"]]
    lines += [f"- trace {t['name']}: {t['sentence']}" for t in said["traces"]]
    lines += [
        f"- {i['kind']}: {i['voyage']} {i['start_s']:.0f} to {i['end_s']:.0f} s: {i['sentence']}"
        for i in said["intervals"]
        if i["kind"] == "external"
    ]
    lines += [
        f"- not seen by the model, {u['variable']}: {u['sentence']}"
        for u in said["unseen"]
        if u["significant"]
    ]
    lines += [f"- {note}" for note in said.get("notes", ())]
    return "\n".join(lines)


def _parameters(parameters: dict) -> str:
    return ", ".join(
        f"{name} {p['value']:.3g} ({p['low']:.3g} to {p['high']:.3g}) {p['unit']}".strip()
        if not isinstance(p["value"], str)
        else f"{name} {p['value']}"
        for name, p in parameters.items()
    )


FINDINGS: dict[str, Callable[[Path, Path], str]] = {
    "sensors": sensors, "published": published, "direct": direct, "refitted": refitted,
    "wind": wind, "milliampere": milliampere, "kvlcc2": kvlcc2,
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
