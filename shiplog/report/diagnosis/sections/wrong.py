"""Where the errors are before any cause is included."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from shiplog.report.diagnosis.sections.written import bullets


@dataclass(frozen=True, slots=True)
class ChannelError:
    """Where the errors are before any cause is included.

    share_of_error  of L, 0 to 1
    where           in words: in which conditions
    """

    channel: str
    share_of_error: float
    where: str


def of(found: Iterable[Mapping]) -> tuple[ChannelError, ...]:
    return tuple(ChannelError(**one) for one in found)


def markdown(wrong: Sequence[ChannelError]) -> list[str]:
    return bullets(
        "Where the errors are",
        [
            f"{one.channel.replace('_', ' ')}: {one.share_of_error:.0%} of the error; {one.where}"
            for one in wrong
        ],
    )
