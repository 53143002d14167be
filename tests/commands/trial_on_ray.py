"""A program: the trial's answers, its voyages held by a Ray cluster of which a node is killed.

    python trial_on_ray.py ADDRESS PID RUN STORE OUT.npz

A process of its own, as Ray reads its token when it is imported.
"""

import sys
from pathlib import Path

import numpy as np
from ray_nodes import end
from shared_trials import asked, trial_of

from shiplog.commands import cluster_trials
from shiplog.diagnosis.trial import trial_products
from shiplog.diagnosis.trial.cluster_blocks import OnCluster

HALF_WAY = 12  # of some forty questions to the blocks


def main(address, pid, run, store, out):
    trial_products.VOYAGES = 1
    real, holders = OnCluster.answer, []

    def answer(self, call):
        holders.append(self)
        if len(holders) == HALF_WAY:
            assert len(set(map(id, self._with))) == 2  # both nodes have voyages
            end(int(pid))
        return real(self, call)

    OnCluster.answer = answer
    with cluster_trials.on_cluster(address) as share:
        found = asked(share(trial_of(Path(run), Path(store))))
        assert len(holders) > 2 * HALF_WAY
        assert len(set(map(id, holders[-1]._with))) == 1
    np.savez(out, **{f"a{number:04d}": one for number, one in enumerate(found)})


if __name__ == "__main__":
    main(*sys.argv[1:])
