"""`shiplog check`."""

from __future__ import annotations

from shiplog.cli.inputs import check_paths
from shiplog.cli.options import JsonOption, Logs, ProfileOption
from shiplog.cli.output import leave


def check(logs: Logs, profile: ProfileOption = None, json_to: JsonOption = None) -> None:
    """What is readable, lost, late or out of order in logs.

    Nothing is stored. Where a profile fits, it also reports which sensors disagree.

    Example: shiplog check sample_logs/voyage_1.mcap
    """
    check_paths(logs, profile)
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.prepare import check_logs

    leave(check_logs(logs, profile), json_to)
