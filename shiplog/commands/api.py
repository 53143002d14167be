"""What `import shiplog` gives: the commands as functions, on the same code.

A store is a `Store` or its folder, a run a `Run` or its folder; voyages are names, shell patterns
such as `june_*`, or voyages of a store. Results are what the command line prints, frozen: `text`,
`json`, and polars frames; a notebook shows the text as Markdown. What is heavy is imported by the
function that needs it: a store opens in a tenth of a second.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from shiplog.exceptions import ShiplogError
from shiplog.nomenclature.channels import WINDOW
from shiplog.voyages.store.store import Store
from shiplog.voyages.store.voyage import Voyage

if TYPE_CHECKING:
    from shiplog.commands.compare import Comparison
    from shiplog.commands.convert import Converted, Draft
    from shiplog.commands.gate import Gate
    from shiplog.commands.prepare import Ingested
    from shiplog.commands.sensors import SensorComparison
    from shiplog.export.exported import Exported
    from shiplog.report.diagnosis.diagnosis import Diagnosis
    from shiplog.report.evaluation.evaluation import Evaluation
    from shiplog.report.fleet.fleet import Fleet
    from shiplog.report.manoeuvres.sheet import ManoeuvreSheet
    from shiplog.report.planning import Planned
    from shiplog.report.season.season import Season
    from shiplog.report.simulation import Simulation
    from shiplog.simulation.schedules import Manoeuvre
    from shiplog.training.runs.load_model import Run

    AnyRun = Run | str | Path
    AnyRuns = AnyRun | Sequence[AnyRun]

AnyStore = Store | str | Path
Paths = str | Path | Iterable[str | Path]
Names = str | Voyage | Iterable[str | Voyage]
Files = str | Path | Sequence[str | Path]
Words = str | Sequence[str]


def check(logs: Paths, *, profile: str | Path | None = None) -> Ingested:
    """What is readable, lost, late or out of order in logs, or folders of them; nothing is stored.

    profile   a shipped profile's name or a TOML's path; found by the log's topics unless given.
              Where one fits, the sensors are compared with each other, too

    Raises ShiplogError where no log could be read.
    """
    from shiplog.commands import prepare

    done = prepare.check_logs(_files(logs), _profile(profile))
    if done.refused and not done.reports:
        raise next(iter(done.refused.values()))
    return done


def ingest(
    logs: Paths,
    store: AnyStore = "store",
    *,
    profile: str | Path | None = None,
    correct: bool = False,
) -> Ingested:
    """Logs, recorders' files, or folders of them, into a store: a 10 Hz table a voyage.

    profile   a shipped profile's name or a TOML's path; found by the log's topics unless given
    correct   also correct each fault of a sensor that the other sensors make certain

    Raises ShiplogError where no log could be taken.
    """
    from shiplog.commands import prepare

    found = prepare.expand(_files(logs))
    done = prepare.ingest_logs(found, _profile(profile), Store(_path(store)), correct)
    if done.refused and not done.reports:
        raise next(iter(done.refused.values()))
    return done


def convert(
    sources: Paths, out: str | Path = "logs", *, profile: str | Path | None = None
) -> Converted:
    """Recorders' files, tables, NMEA 0183 text and ROS bags to MCAP logs in the folder `out`.

    profile   whose [table] section names a table's columns: a shipped profile's name or a TOML's
              path; NMEA and bags need none

    Raises ShiplogError where nothing could be converted.
    """
    from shiplog.commands import convert as converting
    from shiplog.machine.paths import check_writable
    from shiplog.ship_profile import file as profiles

    check_writable(Path(out), "--out")
    of = _profile(profile)
    ship = None if of is None else profiles.load(of)
    done = converting.convert(_files(sources), ship, Path(out))
    if done.refused and not done.logs:
        raise ShiplogError(str(next(iter(done.refused.values()))))
    return done


def profile(
    log: str | Path, out: str | Path | None = None, *, vessel: str | None = None
) -> Draft:  # fmt: skip
    """Draft a ship profile from a log's topics, or a table's columns: `.toml` is its text.

    out      write it there
    vessel   which ship, where the log holds many: its MMSI or name

    Raises ShiplogError.
    """
    from shiplog.commands.convert import draft_profile

    return draft_profile(Path(log), None if out is None else Path(out), vessel)


def open_store(path: str | Path) -> Store:
    """Voyages that were ingested. Raises StoreError where there is no store."""
    store = Store(Path(path))
    store.select([])
    return store


def sensors(store: AnyStore, voyages: Names = ()) -> SensorComparison:
    """Faults of the instruments that several voyages together show. Raises ShiplogError."""
    from shiplog.commands.sensors import compare_sensors

    return compare_sensors(Store(_path(store)), _names(voyages))


def train(
    store: AnyStore,
    out: str | Path,
    *,
    model: str = "feedforward",
    data: str = "ref",
    voyages: Names = (),
    validation: Names = (),
    seeds: int = 1,
    window: int | Literal["auto"] = 100,
    unchecked: bool = False,
    recipe: Literal["fast", "paper"] = "fast",
    width: int = 256,
    wind_input: Literal["angle", "components"] | None = None,
    epochs: int | None = None,
    device: Literal["cpu", "cuda"] = "cpu",
    fit: bool = True,
    parameters: str | Path | None = None,
    without: Words = (),
    free: Words = (),
    folds: int | None = None,
    mapping: str | Path | None = None,
    logs: Files = (),
) -> Run:
    """A model of the voyages, as the run folder `out`.

        shiplog.train(store, "runs/mmg", model="mmg", voyages=["june_*"])

    model        which dynamic model: feedforward, mmg or hybrid; begin with mmg. Or the file of a
                 simulator of your own: FILE.py, FILE.fmu, or logs:/TOPIC
    data         the paper's window set: ref, sli2, ..., d-ref
    voyages      names or shell patterns of the voyages to learn from; all where there are none
    validation   those to validate on
    seeds        how many; they are numbered from 0
    window       length of a window [s]: samples at 1 Hz; or auto, which follows the ship (L/U)
    unchecked    although the profile still says CHECK, or sensors contradict each other

    Of networks:
    recipe       fast, or paper: the published one, which takes hours
    width        units of each hidden layer
    wind_input   angle (default of the paper's recipe) or components (of the fast one)
    epochs       cap on the epochs (paper) or iterations (fast)
    device       cpu, or cuda: the paper's recipe on an NVIDIA GPU, all seeds at once

    Of physical models:
    fit          identify; else the coefficients as they are published or estimated
    parameters   TOML of coefficients to start from
    without      forces to switch off: propeller, rudder, thruster or wind
    free         patterns of the coefficients to identify, such as wind.*; all where there are none
    folds        parts in which voyages are held out in turn, 5 unless given; below 2 none is

    Of a simulator of your own:
    mapping      of an FMU: TOML that says which of its variables is which channel
    logs         that hold its states, of logs:/TOPIC

    Raises ShiplogError for voyages that cannot be trained on, for options that exclude each other
    and for a folder that is taken.
    """
    from shiplog.commands.train import train_command
    from shiplog.foreign.source import recognised
    from shiplog.training.runs import load_model
    from shiplog.training.settings.options import TrainOptions

    if recognised(model):
        return _simulator(
            store, Path(out), model, voyages, validation, window, unchecked, mapping, logs
        )
    options = TrainOptions(
        model=model, data=data, voyages=tuple(_names(voyages)),
        validation=tuple(_names(validation)), seeds=seeds, window=window, unchecked=unchecked,
        recipe=recipe, width=width, wind_input=wind_input, epochs=epochs, device=device, fit=fit,
        parameters=None if parameters is None else Path(parameters),
        without=tuple(_names(without)), free=tuple(_names(free)), folds=folds,
    )  # fmt: skip
    into = Path(out)
    train_command(_path(store), into, options)
    return load_model.load(into)


def _simulator(
    store: AnyStore, out: Path, model: str, voyages: Names, validation: Names,
    window: int | str, unchecked: bool, mapping: str | Path | None, logs: Files,
) -> Run:  # fmt: skip
    """The run of a simulator of the user's own."""
    from shiplog.commands.train_foreign import Given, foreign_command
    from shiplog.training.runs import load_model

    to = None if mapping is None else Path(mapping)
    given = Given(model, to, tuple(_files(logs)), unchecked)
    size = window if isinstance(window, int) else WINDOW
    chosen = tuple(_names(voyages)), tuple(_names(validation))
    foreign_command(given, _path(store), out, *chosen, size)
    return load_model.load(out, simulators=[model])


def load(path: str | Path, causes: Files = (), *, simulators: Files = ()) -> Run:
    """A finished run. `causes`: Python files of its causes that are not in the catalogue, which
    are executed. `simulators`: files of simulators of your own, for a run of one: it is run in a
    child process. Raises RunError."""
    from shiplog.models.causes import user
    from shiplog.training.runs import load_model

    return load_model.load(Path(path), user.load(_files(causes)), _given(simulators))


def evaluate(
    runs: AnyRuns, store: AnyStore, voyages: Names = (), *, causes: Files = (),
    simulators: Files = (),
) -> Evaluation:  # fmt: skip
    """Simulated against measured, window by window, with baselines. Without `voyages`, those that
    the run kept for its test. `causes` and `simulators`: as for `load`. Raises ShiplogError.

    Of one run `evaluation.loss` is its mean L, `evaluation.rmse` its errors, and so on; of several
    `evaluation["mmg"].loss`. `evaluation.baselines` is what they compare with.
    """
    from shiplog.commands import evaluate as evaluating

    return evaluating.evaluate_runs(
        _runs(runs), Store(_path(store)), _names(voyages), _files(causes), _given(simulators)
    )


def compare(
    runs: AnyRuns,
    store: AnyStore,
    voyages: Names = (),
    *,
    save: str | Path | None = None,
    causes: Files = (),
    at: str | None = None,
    simulators: Files = (),
) -> Comparison:
    """The same as a Rerun recording: `save`, or compare.rrd in the first run. `save` may also be
    a .png, .svg or .html. `at`: "VOYAGE:SECONDS" that it is opened at. Raises ShiplogError."""
    from shiplog.commands import compare as comparing

    to = None if save is None else Path(save)
    done = comparing.compare_runs(
        _runs(runs),
        Store(_path(store)),
        _names(voyages),
        to,
        _files(causes),
        at,
        _given(simulators),
    )
    done.written()
    return done


def diagnose(
    run: AnyRun,
    store: AnyStore,
    voyages: Names = (),
    *,
    out: str | Path = "diagnosis",
    extend: str | Path | None = None,
    causes: Files = (),
    ray: str | None = None,
    simulators: Files = (),
) -> Diagnosis:
    """What the model gets wrong on these voyages, why, and what the causes gain on held-out ones.

    out      folder for report, verdict and recording
    extend   write the model with the named causes as this run
    causes   Python files with causes of your own, which are executed
    ray      address of a Ray cluster that holds the segments, for very many voyages
    simulators   as for `load`

    Raises ShiplogError.
    """
    from shiplog.commands import diagnose as diagnosing

    to = None if extend is None else Path(extend)
    (path,) = _runs(run)
    return diagnosing.diagnose_run(
        path, Store(_path(store)), _names(voyages), Path(out), extend=to,
        cause_files=_files(causes), ray=ray, simulators=_given(simulators),
    )  # fmt: skip


def diagnose_list(
    ships: str | Path,
    *,
    out: str | Path = "diagnosis",
    jobs: int | None = None,
    causes: Files = (),
) -> Fleet:
    """Many ships, each in a process of its own; one that fails costs its own row.

    ships    CSV file with the columns run, store and voyages, a line a ship
    out      folder for the table, and for the folder of each diagnosis; what an earlier call did
             there from the same inputs is not done again
    jobs     ships at a time; one a core unless given
    causes   as for `diagnose`

    Raises ShiplogError for a list that cannot be read; `.failed` has the ships without a verdict.
    """
    from shiplog.commands import fleet

    return fleet.diagnose_list(Path(ships), Path(out), jobs=jobs, cause_files=_files(causes))


def gate(
    run: AnyRun,
    store: AnyStore,
    limits: str | Path,
    voyages: Names = (),
    *,
    diagnosis: str | Path | None = None,
    causes: Files = (),
    simulators: Files = (),
) -> Gate:
    """Limits of yours against today's results: `holds`, and an outcome for each limit.

    limits     TOML, as docs/use/gate.md has it
    diagnosis  folder of a diagnosis of these voyages, for limits on verdict and causes; made there
               where there is none
    causes, simulators   as for `load`

    Raises ShiplogError.
    """
    from shiplog.commands import gate as gating

    (path,) = _runs(run)
    where = None if diagnosis is None else Path(diagnosis)
    return gating.gate_run(
        path, Store(_path(store)), Path(limits), _names(voyages), diagnosis=where,
        cause_files=_files(causes), simulators=_given(simulators),
    )  # fmt: skip


def simulate(
    run: AnyRun,
    manoeuvre: Manoeuvre | str | Path,
    store: AnyStore | None = None,
    *,
    speed: float | None = None,
    wind: tuple[float, float] = (0.0, 0.0),
    current: tuple[float, float] = (0.0, 0.0),
    seconds: float | None = None,
    members: int = 200,
    seed: int = 0,
    out: str | Path | None = None,
    causes: Files = (),
    simulators: Files = (),
) -> Simulation:
    """A run's model on a manoeuvre of `shiplog.simulation.schedules`, on the orders of a CSV file,
    or, with `store`, on the inputs of the voyage of that name.

    speed     of the approach through the water, m/s; the run's usual one unless given
    wind      true wind in m/s and where it comes from; `current` and where it sets: deg clockwise
              from x₀
    seconds   instead of until the manoeuvre is complete
    members   of the ensemble, of which the first is the model as it stands; 1 for no other
    out       .parquet, .csv, .mcap or .rrd

    Raises ShiplogError.
    """
    from shiplog.commands import simulate as simulating
    from shiplog.simulation import schedules
    from shiplog.simulation.sailing import Water, from_direction

    (path,) = _runs(run)
    opened = simulating.load(path, _files(causes), _given(simulators))
    to = None if out is None else Path(out)
    if store is not None:
        return simulating.simulate_voyage(
            opened, Store(_path(store)), str(manoeuvre), members=members, seed=seed, out=to
        )
    if isinstance(manoeuvre, str | Path):
        manoeuvre = schedules.read(Path(manoeuvre), opened.profile)
    water = Water(from_direction(*wind), from_direction(*current))
    return simulating.simulate_run(
        opened, manoeuvre, speed=speed, water=water, members=members, seed=seed, seconds=seconds,
        out=to,
    )  # fmt: skip


def export_run(
    run: AnyRun,
    to: str,
    out: str | Path | None = None,
    store: AnyStore | None = None,
    *,
    voyages: Names = (),
    causes: Files = (),
    simulators: Files = (),
) -> Exported:
    """A run in a file of another program, loaded again by that program and compared.

    to       one of `shiplog.export.targets.TARGETS`
    out      the file; the run's name here unless given
    store    of the voyages whose predictions are wanted, with `voyages`
    simulators   as for `load`; an FMU goes into the FMU that is written

    Raises ShiplogError.
    """
    from shiplog.commands import export as exporting
    from shiplog.commands import simulate as simulating
    from shiplog.export import targets
    from shiplog.machine.paths import check_file

    target = targets.of_name(to)
    (path,) = _runs(run)
    opened = simulating.load(path, _files(causes), _given(simulators))
    file = check_file(Path(out or f"{opened.name}{target.ending}"), "out")
    of = None if store is None else Store(_path(store))
    return exporting.export_run(opened, to, file, of, _names(voyages))


def plan(
    run: AnyRun,
    store: AnyStore,
    out: str | Path | None = None,
    *,
    seconds: float | None = None,
    rudder_deg: float | None = None,
    speed: tuple[float, float] | None = None,
    room: tuple[float, float] | None = None,
    wind: tuple[float, float] | None = None,
    causes_only: bool = False,
    seed: int = 0,
    simulators: Files = (),
) -> Planned:
    """What to sail next: the manoeuvre that says most about a run's coefficients within the
    limits, how narrow their intervals will be, and which causes it tells apart. Written to `out`,
    or to the run's folder `plan`.

    rudder_deg   hardest rudder
    speed        m/s between which the ship keeps
    room         m of water ahead and aside
    wind         that is expected: m/s, and deg clockwise from x₀ that it comes from
    simulators   as for `load`; of a run of one, with `causes_only`

    Raises ShiplogError.
    """
    from shiplog.commands import plan as planning
    from shiplog.simulation.sailing import Water, from_direction

    (path,) = _runs(run)
    return planning.plan_run(
        path, Store(_path(store)), None if out is None else Path(out), seconds=seconds,
        rudder=None if rudder_deg is None else math.radians(rudder_deg), speed=speed, room=room,
        water=None if wind is None else Water(wind=from_direction(*wind)), seed=seed,
        causes_only=causes_only, simulators=_given(simulators),
    )  # fmt: skip


def find_manoeuvres(
    runs: AnyRuns = (),
    store: AnyStore | None = None,
    voyages: Names = (),
    *,
    scale: float = 1.0,
    members: int = 100,
    full_load: bool = False,
    causes: Files = (),
    simulators: Files = (),
) -> ManoeuvreSheet:
    """Turns, zigzags, stops, pull-outs and spirals of these voyages, all of the store where none
    is named: measured, and sailed by a run and an extended one. Without `store`, what the runs
    sail by the book. `scale`: how many times the ship is longer than its model. `full_load`: also
    at the profile's second draught. Raises ShiplogError."""
    from shiplog.commands import manoeuvres as finding

    where = None if store is None else Store(_path(store))
    return finding.manoeuvres_of(
        _runs(runs), where, _names(voyages), _files(causes), scale=scale, members=members,
        full_load=full_load, simulators=_given(simulators),
    )  # fmt: skip


def trend(
    run: AnyRun,
    store: AnyStore = "store",
    voyages: Names = (),
    *,
    of: Sequence[str] = (),
    events: Sequence[str] = (),
    limits: Mapping[str, float] | None = None,
    causes: Files = (),
) -> Season:
    """Each cause's size voyage by voyage, and the ship's speed loss at equal revolutions.

    of       causes to follow; unless given, those that a diagnosis of these voyages names
    events   dates of dockings, cleanings and repairs, ISO 8601
    limits   cause → limit of its parameter: {"thrust_loss": 0.9}

    Raises ShiplogError.
    """
    from shiplog.commands import trend as following
    from shiplog.diagnosis.season.asked import parse_date

    (path,) = _runs(run)
    return following.trend_of(
        path, Store(_path(store)), _names(voyages), of=of, events=list(map(parse_date, events)),
        limits=limits, cause_files=_files(causes),
    )  # fmt: skip


def _path(store: AnyStore) -> Path:
    return store.path if isinstance(store, Store) else Path(store)


def _names(voyages: Names) -> list[str]:
    several = [voyages] if isinstance(voyages, str | Voyage) else voyages
    return [one.name if isinstance(one, Voyage) else one for one in several]


def _files(files: Paths) -> list[Path]:
    return [Path(one) for one in ([files] if isinstance(files, str | Path) else files)]


def _given(simulators: Paths) -> list[str]:
    """Files of simulators, or FILE.py:NAME."""
    return [
        str(one) for one in ([simulators] if isinstance(simulators, str | Path) else simulators)
    ]


def _profile(profile: str | Path | None) -> str | None:
    return None if profile is None else str(profile)


def _runs(runs: AnyRuns) -> list[Path]:
    from shiplog.training.runs.load_model import Run

    every = [runs] if isinstance(runs, Run | str | Path) else list(runs)
    return [run.path if isinstance(run, Run) else Path(run) for run in every]
