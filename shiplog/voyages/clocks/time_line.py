"""All that is done to the times of a log before its samples are looked at, in its order.

A recorder that was started again is refused; clocks that were set meanwhile are put right piece by
piece; stamps of no voyage are left out; clocks of another date or another time scale are moved as
a whole; and what then still contradicts is said.
"""

from __future__ import annotations

from dataclasses import dataclass

from shiplog.logs.health.health_report import Finding
from shiplog.logs.reading.read import Reading
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.clocks import clock_contradictions, clock_steps, clocks


@dataclass(frozen=True)
class TimeLine:
    """A log whose sources are on one time line, as far as that is certain.

    contradicted  topics whose clock is not that of the others: then no row can be used
    """

    reading: Reading
    findings: tuple[Finding, ...]
    contradicted: frozenset[str]


def one(reading: Reading, profile: Profile) -> TimeLine:
    """The log on one time line. Raises LogUnreadable where its recorder was started again."""
    clock_steps.refuse_restarted(reading, profile)
    reading, stepped = clock_steps.put_right(reading, profile)
    reading, left_out = clocks.without_strays(reading, profile)
    reading, moved = clocks.on_one_date(reading, profile)
    agreed = clock_contradictions.agreed(reading, profile)
    findings = (*stepped, *left_out, *moved, *agreed.findings)
    return TimeLine(agreed.reading, findings, agreed.contradicted)
