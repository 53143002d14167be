"""What there is to say of an NMEA log, as findings that travel with it."""

from __future__ import annotations

from shiplog.logs.conversion import magnetic
from shiplog.logs.conversion.nmea_clock import Clock
from shiplog.logs.conversion.nmea_topics import Spoken
from shiplog.logs.conversion.nmea_utc import OtherClock, Resolved
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.numbers import counted
from shiplog.nomenclature.units import SECOND_NS

LATE_NS = SECOND_NS // 2  # clocks that differ by more are reported: at 10 m/s 5 m
FEW_DROPPED = 0.01  # share of a topic's sentences before the first time: no log begins at a fix
DAY_NS = 86_400 * SECOND_NS


def damaged(count: int, whole: int) -> Finding:
    sentence = (
        f"{counted(count, 'damaged sentence')} beside {whole} whole ones left out: the checksum is "
        "wrong or lost, or a field is none."
    )
    return Finding("dropped", "log", sentence, value=float(count))


def renamed(key: tuple[str, str], count: int) -> Finding:
    sentence = (
        f"The checksums of {count} sentences {''.join(key)} are wrong, all in the same bits: their "
        "talker was renamed on the way. They are used."
    )
    return Finding("two_sources", "log", sentence, value=float(count))


def findings(spoken: Spoken, resolved: Resolved, clock: Clock, talkers: list[str]) -> list[Finding]:
    """All but the damage. Times are seconds from the log's first message."""
    logged = [one.time if one.log_time is None else one.log_time for one in spoken.series]
    begin = min(int(times.min()) for times in logged if len(times))
    found = _statuses(spoken, begin)
    found += _receivers(spoken)
    found += [_other_clock(other, talkers) for other in resolved.others]
    found += _recorder(clock, begin)
    found += [compass(*one) for one in spoken.compasses]
    found += [
        Finding("two_sources", topic, f"{sentences} lie {metres:.1f} m apart at the same time: "
                "two receivers send under one talker.", value=metres, unit="m")
        for topic, (sentences, metres) in (("/gnss/fix", one) for one in spoken.apart)
    ]  # fmt: skip
    lost = sum(spoken.dropped.values())
    total = sum(len(one.time) for one in spoken.series)
    if lost > FEW_DROPPED * total:
        sentence = f"{lost} sentences before the first time in the log are not used."
        found.append(Finding("dropped", "log", sentence, value=float(lost)))
    if repeated := sum(spoken.repeated.values()):
        sentence = f"{repeated} sentences came twice with the same UTC and content; one is used."
        found.append(Finding("duplicate", "log", sentence, value=float(repeated)))
    return found


def _statuses(spoken: Spoken, begin: int) -> list[Finding]:
    """One finding for each topic and reason: how many, and from when to when."""
    found = []
    for topic, why, when, total in spoken.blanks:
        start, end = ((int(t) - begin) / SECOND_NS for t in (when.min(), when.max()))
        sentence = (
            f"{len(when)} of {total} messages on {topic} are blank by the instrument's own word, "
            f"which is {why}, from {start:.1f} s to {end:.1f} s."
        )
        found.append(Finding("status", topic, sentence, start, end, float(len(when))))
    return found


def _receivers(spoken: Spoken) -> list[Finding]:
    return [
        Finding(
            "two_sources", "/gnss/fix",
            f"Two receivers send under the talker {talker}; the second one is {name}. Choose the "
            "topic in [sensors.position].", value=2.0,
        )
        for talker, name in spoken.receivers
    ]  # fmt: skip


def _other_clock(other: OtherClock, talkers: list[str]) -> Finding:
    who = ", ".join(talkers[sender] for sender in other.senders)
    ahead = other.ahead_ns / SECOND_NS
    if other.still:
        sentence = (
            f"{other.count} sentences of {who} bear a time that does not run with the others'; "
            "they are blank, and no other takes its time from them."
        )
        return Finding("clock_offset", "log", sentence, value=float(other.count))
    if other.days:
        weeks, rest = divmod(abs(other.days), 7)
        far = f"{weeks} weeks" if not rest else f"{abs(other.days)} days"
        why = ", which is a week counter that rolled over" if other.days % 7168 == 0 else ""
        side = "before" if other.days < 0 else "after"
        sentence = (
            f"The date in {other.count} sentences of {who} is {far} {side} the others'{why}; it "
            "was put right."
        )
    else:
        side = "ahead of" if ahead > 0 else "behind"
        why = ": GPS time, which has no leap seconds?" if round(abs(ahead)) in range(13, 20) else ""
        sentence = (
            f"The clock in {other.count} sentences of {who} is {abs(ahead):.1f} s {side} the "
            f"others'{why}. They keep their own time."
        )
    return Finding("clock_offset", "log", sentence, value=ahead, unit="s")


def _recorder(clock: Clock, begin: int) -> list[Finding]:
    """The recorder's clock against GNSS time: what was put right, and what cannot be known."""
    recorder, found = clock.recorder, []
    if recorder.weeks:
        sentence = (
            f"The receiver's date is {recorder.weeks} weeks before the receive stamps: its week "
            "counter rolled over; it was put right."
        )
        value = -recorder.weeks * 7 * DAY_NS / SECOND_NS
        found.append(Finding("clock_offset", "log", sentence, value=value, unit="s"))
    if recorder.shared > 1:
        span = recorder.burst_ns / SECOND_NS
        each = span / recorder.shared
        sentence = (
            f"The recorder stamped bursts: {recorder.shared} sentences of one instrument bear one "
            f"stamp. They are spread over the {span:.2f} s since the burst before, good to "
            f"{each:.2f} s."
        )
        found.append(Finding("burst", "log", sentence, value=each, unit="s"))
    offsets = [o for _, o in recorder.offsets]
    if recorder.drift_ns:
        sentence = (
            f"The receive stamps drift by {recorder.drift_ns / SECOND_NS:.2f} s against GNSS time; "
            "sentences without a time of their own are put right by the UTC next to them."
        )
        value = recorder.drift_ns / SECOND_NS
        found.append(Finding("clock_offset", "log", sentence, value=value, unit="s"))
    elif len(offsets) > 1:
        parts = ", ".join(
            f"{o / SECOND_NS:+.2f} s from {max(at - begin, 0) / SECOND_NS:.0f} s on"
            for at, o in recorder.offsets
        )
        sentence = (
            f"The recorder's clock was set while it recorded: against GNSS time {parts}. Sentences "
            "without a time of their own are put right by it."
        )
        value = max(offsets, key=abs) / SECOND_NS
        found.append(Finding("jump", "log", sentence, value=value, unit="s"))
    elif offsets and abs(offsets[0]) > LATE_NS:
        sentence = (
            f"The receive stamps are {offsets[0] / SECOND_NS:+.2f} s against GNSS time; sentences "
            "without a time of their own are put back by that, good to the receiver's latency."
        )
        value = offsets[0] / SECOND_NS
        found.append(Finding("clock_offset", "log", sentence, value=value, unit="s"))
    if recorder.latency_ns is not None and recorder.latency_ns > LATE_NS:
        late = recorder.latency_ns / SECOND_NS
        sentence = (
            f"The receiver's sentences come {late:.2f} s after their fix: taken for its latency. "
            "Sentences without a time of their own keep their receive stamps, which are late by as "
            "much if it is the recorder's clock."
        )
        found.append(
            Finding("clock_offset", "/gnss/fix", sentence, value=late, low=0.0, high=late, unit="s")
        )
    return found


def compass(topic: str, kind: str, made: magnetic.Variation | None) -> Finding:
    """The variation that made a compass true, or that none could be found."""
    if made is None:
        sentence = (
            f"{kind} is a magnetic heading, and neither a variation nor place and date for one are "
            f"in the log: {topic} is magnetic. Set `offset` in [sensors.heading]."
        )
        return Finding("heading_offset", topic, sentence, unit="deg")
    source = f"of {made.source}" if made.source in ("RMC",) else f"of the {made.source}"
    if made.source == "sentence":
        source = "of the sentence itself"
    sentence = (
        f"{topic} is of a magnetic compass ({kind}), made true by a variation of "
        f"{made.degrees:+.1f} deg {source}."
    )
    if not made.deviation:
        sigma = magnetic.DEVIATION_SIGMA_DEG
        sentence += f" Its deviation is not given: sigma = {sigma:g} in [sensors.heading]."
    if made.differs:
        sentence += (
            f" The World Magnetic Model has {made.model_deg:+.1f} deg here: the compass is set "
            "wrong. Correct it by `offset` in [sensors.heading]."
        )
        off = made.degrees - (made.model_deg or 0.0)
        return Finding("contradiction", topic, sentence, value=off, unit="deg", reason="frame")
    return Finding("heading_offset", topic, sentence, value=made.degrees, unit="deg")
