"""What tests share: compiled functions, their order, the folder of real logs where there is one."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from xdist.scheduler import LoadFileScheduling

from shiplog.machine import disk_cache
from shiplog.simulation.kernel import machine_code

# Many small matrices: BLAS's threads would wait for each other. Set before numpy is loaded.
for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NPROC"):
    os.environ.setdefault(_threads, "1")
# What one worker, or a command that a test starts, has compiled serves the others.
disk_cache.keep_compiled()

import jax  # noqa: E402  # reads what was set above

# Tests work answers out with JAX themselves; that shiplog needs no such switch has its own test.
jax.config.update("jax_enable_x64", True)

# Modules of more than twenty seconds, the longest first: the workers then end together. A module is
# one worker's, with the fixtures that are made once for it.
LONGEST = (
    "commands/test_real_logs.py", "commands/test_demo.py", "diagnosis/test_whole_way.py",
    "diagnosis/test_whole_way_trials.py", "diagnosis/test_network_base.py",
    "commands/test_gate_seasons.py",
    "commands/test_tour.py", "commands/test_paper.py", "commands/test_train_physics.py",
    "voyages/test_sensor_consistency.py", "cli/test_endings.py",
    "diagnosis/test_without_wind_sensor.py", "experiments/test_simulated_effects.py",
    "experiments/test_simulated_logs.py", "voyages/test_sensor_correction.py",
    "diagnosis/test_residual_acceleration.py", "cli/test_same_numbers.py",
)  # fmt: skip
ONE_WORKER = ("tests/diagnosis/test_whole_way",)  # files that begin so are one worker's together


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest modules first; the others as they were found."""
    tests = Path(__file__).parent
    rank = {tests / name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: rank.get(item.path, len(rank)))


class ByFixtures(LoadFileScheduling):
    """A file is one worker's, and so are the files of ONE_WORKER: their fixtures take minutes."""

    def _split_scope(self, nodeid: str) -> str:
        shared = (name for name in ONE_WORKER if nodeid.startswith(name))
        return next(shared, super()._split_scope(nodeid))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log) -> ByFixtures:
    return ByFixtures(config, log)


# Where CI has installed what a test needs, or has seen it, a test that skips for want of it fails.
REQUIRED = {  # variable: a word of the reasons for which such tests skip
    "SHIPLOG_REQUIRE_SHARED": "../shared/data",
    "SHIPLOG_REQUIRE_VIEWER": "headless viewer",
    "SHIPLOG_REQUIRE_BROWSER": "chromium",
}


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    if report.skipped and isinstance(report.longrepr, tuple):
        _path, _line, reason = report.longrepr
        for variable, word in REQUIRED.items():
            if os.environ.get(variable) and word in reason:
                report.outcome, report.longrepr = "failed", f"{variable} is set. {reason}"
    return report


@pytest.fixture
def by_jax(monkeypatch: pytest.MonkeyPatch) -> None:
    """No kernel: JAX runs the models."""
    monkeypatch.setattr(machine_code, "level", lambda wanted=None: None)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """`../shared/data` next to the repository; it is not shipped."""
    folder = Path(__file__).parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("../shared/data is not here")
    return folder


@pytest.fixture(scope="module")
def trained_here():
    """Networks are trained in this process, task by task: to start another one and to load torch
    there takes longer than a short training. The queue of processes has tests of its own."""
    from shiplog.commands import train_networks
    from shiplog.exceptions import ShiplogError
    from shiplog.training.network.queue import Event

    def work(tasks, workers=None):
        for task in tasks:
            yield Event(task, 0.0)
            try:
                result = task.function(*task.arguments, report=lambda share: None)
                yield Event(task, 1.0, True, result)
            except ShiplogError as error:
                yield Event(task, 0.0, True, failure=str(error))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(train_networks, "work", work)
        yield


@pytest.fixture(scope="session")
def no_viewer():
    """Skip, for this reason: a headless viewer cannot be started."""
    return pytest.skip
