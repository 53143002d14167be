"""Two Ray nodes hold a trial's voyages, one is killed half-way: nothing lost, not one number
different."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from ray_nodes import two_nodes
from shared_trials import asked, refuse_different, trial_of

from shiplog.diagnosis.trial import trial_products

pytest.importorskip("ray", reason="needs Ray: pip install '.[ray]'")

TESTS = Path(__file__).parents[1]
LIMIT_S = 200.0


@pytest.fixture
def nodes(tmp_path):
    with two_nodes(tmp_path) as made:
        yield made


def test_a_node_that_dies_costs_no_number(nodes, published, store, monkeypatch, tmp_path):
    address, worker = nodes
    program, out = TESTS / "commands" / "trial_on_ray.py", tmp_path / "found.npz"
    paths = os.pathsep.join(map(str, (TESTS.parent, TESTS, os.environ.get("PYTHONPATH", ""))))
    arguments = map(str, (program, address, worker.pid, published[0], store, out))
    done = subprocess.run(
        [sys.executable, *arguments], env=os.environ | {"PYTHONPATH": paths}, timeout=LIMIT_S,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    monkeypatch.setattr(trial_products, "VOYAGES", 1)
    with np.load(out) as found:
        theirs = [found[name] for name in sorted(found.files)]
    refuse_different(theirs, asked(trial_of(published[0], store)))
