"""A search that has weighed hypotheses with scores of one's own."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import straight

from shiplog.diagnosis.hypotheses.hypothesis import Hypothesis
from shiplog.diagnosis.hypotheses.search import Search
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED, Remainder
from shiplog.diagnosis.trial.fitted import Estimate

SIZE = 0.5  # of every number, where none is given: what matters is 0.1 and, of one, 0.4


def trial() -> straight.Straight:
    """One with nothing in it."""
    columns = straight.columns_of(straight.CAUSES)
    nominal, record = straight.sailed(8), straight.sailed(4, seed=3)
    campaign = straight.campaign(nominal, straight.passed(nominal, columns), columns)
    return straight.trial(campaign, record, straight.passed(record, columns, seed=2))


def search(
    of: straight.Straight,
    probability: Mapping[tuple[tuple[str, ...], str], float],
    *,
    evidence: Mapping[tuple[tuple[str, ...], str], float] | None = None,
    sizes: Mapping[str, float] | None = None,
    side_force: SideForce | None = None,
    raised: float = 2.0,
    spread: float = 0.1,
) -> Search:
    """Hypotheses (causes, kind) with these probabilities, up to a factor.

    evidence   of a hypothesis; 100 nats a cause where none is given
    sizes      of a label's numbers
    raised     factor of raised process noise, alone or together with an intermittent force
    spread     standard deviation of every number
    """
    point = of.first
    assert point is not None
    made = Search(of, point, {})
    columns = of.reference.columns
    given = {((), NOMINAL): 1e-12, **probability}
    for (labels, kind), p in given.items():
        numbers = {
            n: np.full(len(columns.indices[n]), (sizes or {}).get(n, SIZE)) for n in sorted(labels)
        }
        count = sum(map(len, numbers.values()))
        output = (evidence or {}).get((labels, kind), 100.0 * len(labels))
        noise = raised if kind == RAISED else 1.0
        found = Estimate("+".join(labels), output, noise, numbers, spread**2 * np.eye(count))
        remainder = Remainder(kind, 3.0)
        if kind == INTERMITTENT:
            beyond = np.sqrt(raised**2 - 1.0) * of.reference.process_noise.acceleration
            remainder = Remainder(kind, intermittent=tuple(map(float, beyond)))
        score = float(np.log(p)) - 40.0
        made.table.found[labels, kind] = Hypothesis(
            tuple(sorted(labels)), remainder, output, score, point, found, side_force
        )
    made.run = lambda: None  # there is nothing else to weigh
    made.table.alone = {cause.label: 1.0 for cause in made.table.catalogue}
    return made
