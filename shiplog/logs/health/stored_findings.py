"""Findings that a log carries: what its conversion found and no reader of it could see again.

They stand in the metadata record `findings`, one JSON text each, under a number.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields

from shiplog.logs.health.health_report import FINDING_KINDS, REASONS, Finding

RECORD = "findings"  # the metadata record's name
MOST = 1000  # of a log that is not ours, too
KNOWN = frozenset(field.name for field in fields(Finding))


def as_record(findings: Sequence[Finding]) -> dict[str, str]:
    """The entries of the metadata record."""
    return {
        f"{number:04d}": json.dumps(
            {name: value for name, value in asdict(finding).items() if value not in (None, "")}
        )
        for number, finding in enumerate(findings[:MOST])
    }


def of_record(metadata: Mapping[str, Mapping[str, str]]) -> list[Finding]:
    """The findings in a log's metadata records; what is none is left out."""
    found = []
    for _, text in sorted(metadata.get(RECORD, {}).items())[:MOST]:
        try:
            content = json.loads(text)
            finding = Finding(**{k: v for k, v in content.items() if k in KNOWN})
        except (ValueError, TypeError, AttributeError):
            continue
        known = finding.kind in FINDING_KINDS and finding.reason in ("", *REASONS)
        if known and isinstance(finding.sentence, str):
            found.append(finding)
    return found
