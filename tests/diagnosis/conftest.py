"""A trial on a straight course; and a campaign and trials that go the whole way, made once."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import straight
from dense_trial import DRAG, SHARE
from straight import CAUSES
from whole_way import NOMINAL, PROFILE, TIDE, hidden, judged, log

from shiplog.commands import diagnose as pipeline
from shiplog.commands.identify import identify_run
from shiplog.commands.prepare import ingest_logs
from shiplog.training.settings.run_config import Config, Physics
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.rows import recording  # fmt: skip
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split import choose_physical_split


@pytest.fixture(scope="module")
def made():
    """A campaign of 12 segments, a trial of 8 in two voyages, and their columns."""
    columns = straight.columns_of(CAUSES)
    nominal, record = straight.sailed(12), straight.sailed(8, seed=3)
    nominal = straight.campaign(
        nominal, straight.passed(nominal, columns, sensitivity=0.3), columns, share=SHARE
    )
    numbers = np.zeros(columns.linearised)
    numbers[columns.indices["drag"]] = DRAG
    given = straight.passed(record, columns, numbers, seed=2, sensitivity=0.3)
    return nominal, record, given


@pytest.fixture
def trial(made):
    return straight.trial(*made)


@pytest.fixture(scope="session")
def sea(tmp_path_factory):
    """The whole way, once: run, store, posterior, the diagnosis of a trial with a current."""
    work = tmp_path_factory.mktemp("sea")
    (work / "logs").mkdir()
    case = hidden("current", size=2.3)  # 0.14 m/s
    paths = [log(case, leg, work / "logs") for leg in case.nominal if leg.name in NOMINAL]
    paths += [log(case, leg, work / "logs") for leg in case.trial]
    short = replace(case.trial[0], name="short", seconds=100.0)
    paths.append(log(hidden("none"), short, work / "logs"))
    store = Store(work / "store")
    assert not ingest_logs(paths, "esso-vectwin", store).refused
    split = choose_physical_split(store, ("nominal_*",), (), "ref", 100)
    config = Config(model="mmg", split=split, physics=Physics(folds=2))
    run, _ = identify_run(config, store, work / "mmg")
    (work / "tide.py").write_text(TIDE, encoding="utf-8")
    done = pipeline.diagnose_run(
        run.path, store, ["trial_*"], work / "out", extend=work / "extended",
        cause_files=[work / "tide.py"],
    )  # fmt: skip
    return SimpleNamespace(
        work=work, store=store, run=run, done=done, case=case, campaign=done.trial.campaign
    )


@pytest.fixture(scope="session")
def trials(sea, tmp_path_factory):
    """Cause → record of a trial with it hidden."""
    kept = {}

    def of(cause: str, **changes):
        key = (cause, *sorted(changes.items()))
        if key not in kept:
            case = hidden(cause, **changes)
            folder = tmp_path_factory.mktemp("trial")
            made = [ingest(log(case, leg, folder), PROFILE) for leg in case.trial]
            read = recording.read([v.table for v in made], [v.name for v in made], PROFILE)
            kept[key] = replace(read, timescale=sea.done.trial.record.timescale)
        return kept[key]

    return of


@pytest.fixture(scope="session")
def still(sea, trials):
    return judged(sea.campaign, trials("none"))


@pytest.fixture(scope="session")
def compass(sea, trials):
    return judged(sea.campaign, trials("heading_offset"))
