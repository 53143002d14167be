"""The published experiment: eight window sets, many seeds, tables and figures of what came out."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from shiplog.commands import gpu as on_gpu
from shiplog.commands import train_networks
from shiplog.commands.bars import reach, staged, through
from shiplog.commands.evaluate import evaluate_runs
from shiplog.exceptions import ShiplogError, listed
from shiplog.machine import files
from shiplog.nomenclature.channels import VELOCITY
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted
from shiplog.report import viewer
from shiplog.report.evaluation.text_table import inert
from shiplog.report.page.paper import page as paper_page
from shiplog.report.paper import figures, report, sets, statements
from shiplog.report.paper.report import Results
from shiplog.report.result import Answer
from shiplog.ship_profile.profile import Profile
from shiplog.training.network import gpu
from shiplog.training.network.queue import Task
from shiplog.training.runs import network_seeds, run_folder
from shiplog.training.runs.run_checks import (
    refuse_none_trained,
    refuse_other_rows,
    refuse_other_settings,
)
from shiplog.training.runs.run_folder import RunFolder
from shiplog.training.settings.options import TrainOptions
from shiplog.training.settings.run_config import Config
from shiplog.voyages.store import parts
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split import choose_split, plan, refuse_no_test, say
from shiplog.voyages.windows.split_settings import Split

log = logging.getLogger(__name__)

BASELINES = {"hold": "holds the velocity", "least_squares": "quadratic least squares"}
HALF = 0.5  # of the training seconds that the reference set has at most, d-ref having all


@dataclass(frozen=True)
class Voyages:
    """Which voyages the sets are cut from: `d_ref` has about twice the data of `reference`."""

    reference: tuple[str, ...]
    d_ref: tuple[str, ...]
    validation: tuple[str, ...]
    test: tuple[str, ...]
    chosen_by: str

    def of(self, data: str) -> Split:
        return Split(
            training=self.d_ref if data == "d-ref" else self.reference,
            validation=self.validation,
            test=self.test,
            chosen_by=self.chosen_by,
        )


def paper_command(
    store_path: Path,
    out: Path,
    *,
    data: Sequence[str],
    voyages: Sequence[str],
    validation: Sequence[str],
    seeds: int,
    recipe: str,
    window: int,
    width: int,
    epochs: int | None,
    jobs: int | None,
    ray: str | None,
    device: str,
    page: Path | None = None,
) -> Answer:
    """`shiplog paper`: every set, every seed, then tables and figures. Interrupted, the same
    command goes on. Raises ShiplogError."""
    there = None if device == gpu.CPU else gpu.find()
    store = Store(store_path)
    chosen = choose_voyages(store, voyages, validation, window)
    say(chosen.of("d-ref"))
    log.info("reference set: %s", listed(chosen.reference))
    options = TrainOptions(recipe=recipe, window=window, seeds=seeds, width=width, epochs=epochs)
    settings = options.settings() | {"standard": chosen.reference}
    configs = {
        name: Config.model_validate({**settings, "data": name, "split": chosen.of(name)})
        for name in data
    }
    finished, failures = train_sets(configs, store, out / "runs", jobs, ray, there)
    refuse_none_trained(finished, failures)
    results = collect(finished, failures, store)
    lines = write(results, chosen, store, out)
    content = {
        "contract": CONTRACT,
        "ship": next(iter(finished.values())).profile.ship.name,
        "folder": str(out),
        "recording": str(out / "paper.rrd"),
        "recipe": recipe,
        "split": chosen.of("d-ref").model_dump(mode="json"),
        "reference": list(chosen.reference),
        "sets": report.summary(results).to_dicts(),
        "statements": results.compared.to_dicts(),
        "floors": results.evaluation.means,
        "failures": failures,
    }
    files.write_json(out / paper_page.ANSWER, content)
    lines += _paged(out, page)
    return Answer(lines, content)


def _paged(out: Path, page: Path | None) -> list[str]:
    """The page, where one is asked for."""
    if page is None:
        return []
    from shiplog.report.page import html

    return ["", f"Page: {html.write(paper_page.of_folder(out), page)}"]


def choose_voyages(
    store: Store, voyages: Sequence[str], validation: Sequence[str], size: int
) -> Voyages:
    """As in the paper's Table 3 where there are six voyages; else the training voyages are halved
    in time, and the reference set has the first half. Where the user names those that validate,
    all that are not used otherwise test. Raises StoreError without a test voyage."""
    whole = choose_split(store, voyages, validation, "d-ref", size)
    if validation:
        whole = whole.model_copy(update={"test": _unused(store, whole, size)})
    refuse_no_test(whole)
    first = choose_split(store, voyages, validation, "ref", size)
    reference, chosen_by = first.training, whole.chosen_by
    if reference == whole.training:
        reference = _first_half(store, whole.training)
        chosen_by += "; the reference set has the first half of the training voyages"
    return Voyages(reference, whole.training, whole.validation, whole.test, chosen_by)


def _unused(store: Store, split: Split, size: int) -> tuple[str, ...]:
    """Voyages with a window that neither train nor validate. Raises StoreError for two ships."""
    used = (*split.training, *split.validation)
    names = [name for name in store.select() if not parts.overlapping([name], used)]
    if not names:
        return ()
    rows = store.seconds(names, store.profile([*used, *names]))
    return tuple(plan(rows, "ref", size)["voyage"].unique(maintain_order=True))


def _first_half(store: Store, names: Sequence[str]) -> tuple[str, ...]:
    """Whole voyages with about half of the seconds; of a single one its first half."""
    rows = store.seconds(names, store.profile(names))
    lengths = {str(n): c for n, c in rows.group_by("voyage").len().iter_rows()}
    begins = dict(rows.group_by("voyage").agg(pl.col("time").min()).iter_rows())
    order = sorted(names, key=lambda n: (begins[n], n))
    if len(order) == 1:
        return (_halved(order[0], rows["elapsed"]),)
    taken: list[str] = []
    for name in order[:-1]:
        if taken and sum(lengths[n] for n in [*taken, name]) > HALF * sum(lengths.values()):
            break
        taken.append(name)
    return tuple(taken)


def _halved(name: str, elapsed: pl.Series) -> str:
    """The first half of the usable seconds, each `elapsed` since the voyage's or part's begin."""
    part = parts.parse(name) or parts.Part(name, 0, 0)
    middle = int(elapsed[len(elapsed) // 2])
    return str(parts.Part(part.whole, part.begin, part.begin + middle))


def train_sets(
    configs: Mapping[str, Config],
    store: Store,
    out: Path,
    jobs: int | None,
    ray: str | None,
    there: gpu.Device | None = None,
) -> tuple[dict[str, RunFolder], dict[str, str]]:
    """Every training of every set in one queue, or on the GPU `there`. Finished sets, and
    trainings that failed."""
    finished: dict[str, RunFolder] = {}
    begun: dict[str, train_networks.Begun] = {}
    failures: dict[str, str] = {}
    tasks: list[Task] = []
    for name, config in configs.items():
        path = out / name
        try:
            if path.is_dir():
                done = run_folder.open_finished(path)
                refuse_other_settings(done, config)
                refuse_other_rows(done, store)
                finished[name] = done
                continue
            begun[name] = train_networks.begin(config, store, path)
        except ShiplogError as error:  # such as a folder that is of other settings
            failures[name] = str(error)
            continue
        tasks += network_seeds.tasks_of(begun[name].run)
    if tasks and ray is not None:
        from shiplog.commands import cluster

        failures |= cluster.do(tasks, ray)
    elif tasks and there is not None:
        failures |= on_gpu.do(tasks, there)
    elif tasks:
        failures |= train_networks.do(tasks, jobs)
    device = gpu.CPU if there is None else gpu.name(there)
    for name, one in through(list(begun.items()), "finishing", lambda _: 1.0):
        if all(one.run.finished(seed) for seed in one.run.config.seeds):
            finished[name] = train_networks.finish(one, device)
    return {name: finished[name] for name in configs if name in finished}, failures


def collect(finished: dict[str, RunFolder], failures: dict[str, str], store: Store) -> Results:
    """Test losses, validation losses and comparisons of the sets that are finished."""
    test = next(iter(finished.values())).config.split.test
    evaluation = evaluate_runs([run.path for run in finished.values()], store, test)
    losses = (
        evaluation.errors.group_by("run", "seed", maintain_order=True)
        .agg(loss=pl.col("loss").mean())
        .rename({"run": "set"})
    )
    histories = pl.concat(
        run.history(seed).select(set=pl.lit(name), seed=pl.lit(seed), epoch="epoch",
                                 training="training", validation="validation", smoothed="smoothed")
        for name, run in finished.items()
        for seed in run.config.seeds
    )  # fmt: skip
    return Results(
        finished, failures, losses, histories, statements.differences(losses), evaluation
    )


@staged("writing", {"rows": 1.0, "figures": 8.0, "recording": 1.0})
def write(results: Results, chosen: Voyages, store: Store, out: Path) -> list[str]:
    """Tables as Parquet, figures as SVG and PNG, report.md and paper.rrd in `out`. Returns the
    report."""
    numbers, drawn = out / "tables", out / "figures"
    for folder in (numbers, drawn):
        folder.mkdir(parents=True, exist_ok=True)
    first = next(iter(results.runs.values()))
    profile, size = first.profile, first.config.window
    plans = {name: run.windows() for name, run in results.runs.items()}
    sizes = sets.sizes(plans, {n: r.config.split.training for n, r in results.runs.items()}, size)
    rows = {
        name: store.seconds(names, profile)
        for name, names in (("ref", chosen.reference), ("d-ref", chosen.d_ref),
                            ("validation", chosen.validation), ("test", chosen.test))
    }  # fmt: skip
    columns = [*(c.name for c in VELOCITY), *profile.actuator_names]
    histograms = sets.histograms(rows, columns, _angles(profile))
    rollouts = results.evaluation.rollouts.rename({"run": "set"})
    frames = {
        "sizes": sizes, "histograms": histograms, "test_losses": results.losses,
        "validation_losses": results.histories, "statements": results.compared,
        "rollouts": rollouts,
    }  # fmt: skip
    pictures: dict[str, Path] = {}
    reach("figures")

    def path(name: str) -> Path:
        pictures[name] = drawn / f"{name.replace(' ', '_')}.png"
        return pictures[name].with_suffix("")

    figures.histograms(histograms, _units(profile), path("histograms"))
    if profile.has_wind:
        frames["wind"] = sets.wind(rows)
        figures.wind(frames["wind"], path("wind"))
    figures.validation(results.histories, path("validation loss"))
    baselines = {BASELINES.get(name, name): loss for name, loss in results.evaluation.means.items()}
    figures.test(results.losses, baselines, path("test loss"))
    voyage = _longest(results.evaluation.errors)
    measured = results.evaluation.rows.filter(pl.col("voyage") == voyage)
    figures.inputs(measured, _units(profile), path("inputs"))
    own = rollouts.filter(pl.col("voyage") == voyage)
    for name in results.runs:
        if name != "ref" and "ref" in results.runs:
            figures.states(own, measured, ("ref", name), path(f"ref and {name}"))
    reach("recording")
    for name, frame in frames.items():
        files.write_frame(numbers / f"{name}.parquet", frame)
    lines = report.lines(results, chosen.chosen_by, sizes)
    text = "\n".join(lines)
    files.write_text(out / "report.md", inert(text) + "\n")
    title = f"{profile.ship.name}: {counted(len(results.runs), 'window set')}"
    viewer.save_album(title, text, pictures, out / "paper.rrd")
    return lines


def _longest(errors: pl.DataFrame) -> str:
    """The test voyage with the most windows; the first of several."""
    count = errors.group_by("voyage", maintain_order=True).len()
    return count.sort("len", descending=True, maintain_order=True)["voyage"][0]


def _angles(profile: Profile) -> frozenset[str]:
    """Actuators that are angles."""
    return frozenset(a.name for a in profile.actuators if a.si_unit == "rad")


def _units(profile: Profile) -> dict[str, str]:
    """Of actuators and wind as figures show them."""
    names = {"rad": "deg", "rev/s": "rev/s", "1": "1"}
    units = {a.name: names.get(a.si_unit, a.si_unit) for a in profile.actuators}
    return units | ({"wind_speed": "m/s", "wind_angle": "deg"} if profile.has_wind else {})
