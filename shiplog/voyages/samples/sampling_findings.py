"""What the stamps of a voyage's channels are worth, and between which samples there is no value.

Each sentence names the channels, the size, and the key of the profile that says otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from shiplog.exceptions import listed
from shiplog.logs.health.health_report import Finding
from shiplog.ship_profile.profile import Actuator
from shiplog.voyages.rows.resampling import Samples

NO_TWO_ALIKE = 0.98  # of the samples differ from the one before: nothing is sent unless it changes
FEWEST = 4  # samples that show it
IRREGULAR = 2.0  # 90 % point over 10 % point of the times between such samples
SILENT_S = 3.0  # a longer silence of an order, while the heading goes on, is no jitter
SILENCES = 0.1  # of the steps: so many are such silences, and not a radio that failed once
LEVELS = 500  # at most, of orders that are given in steps; a measured angle has noise
ON_LEVEL = 0.01  # of a step
UNCERTAIN_S = 0.05  # a time that is surer than this is worth no word,
MANY, SOME = 0.05, 0.005  # unless it is of so many samples; of fewer than the latter, in no case


def order_of(samples: Samples, actuator: Actuator, base: np.ndarray) -> Samples:
    """The samples of an actuator; held from one to the next where they show that it is an order
    that is sent when it changes, and the profile does not say what stands between them.

    base  [m] ns, times of the heading: what was silent together with it was not recorded
    """
    stated = {"between", "tolerance_s"} & actuator.model_fields_set
    if stated or samples.hold or not _sent_on_change(samples, base):
        return samples
    if _in_levels(samples.value):
        return replace(samples, hold=True, tolerance_s=np.inf, taken_for_order=True)
    return replace(samples, taken_for_order=True)


def _sent_on_change(samples: Samples, base: np.ndarray) -> bool:
    time, value = samples.time, samples.value
    if len(time) < FEWEST:
        return False
    step = np.diff(time) * 1e-9
    low, high = np.quantile(step, (0.1, 0.9))
    heard = np.diff(np.searchsorted(base, time)) >= 2
    silent = (step > SILENT_S) & heard
    differing = (np.diff(value, axis=0) != 0).any(axis=1).mean()
    return bool(differing >= NO_TWO_ALIKE and high >= IRREGULAR * low and silent.mean() >= SILENCES)


def _in_levels(value: np.ndarray) -> bool:
    """Whether values [n, k] are whole numbers of one step, as orders are."""
    for column in value.T:
        levels = np.unique(np.round(column, 9))
        apart = np.diff(levels)
        if len(apart) == 0:
            continue
        least = float(apart.min())
        if np.ptp(levels) > LEVELS * least:
            return False
        if np.abs(apart / least - np.rint(apart / least)).max() > ON_LEVEL:
            return False
    return True


def findings(every: Mapping[str, Samples], actuators: frozenset[str]) -> list[Finding]:
    """One finding for each thing that the stamps of one or several channels show."""
    found: list[Finding] = []
    bursts: dict[tuple, list[str]] = {}
    coarse: dict[float, list[str]] = {}
    for name, samples in every.items():
        if samples.burst is not None and _worth_a_word(samples):
            one = samples.burst
            key = (round(one.each_s, 1), one.cut_s, round(one.unsure_s, 2))
            bursts.setdefault(key, []).append(name)
        if samples.step_s:
            coarse.setdefault(round(samples.step_s, 6), []).append(name)
        if samples.dropped:
            found.append(_dropped(name, samples))
        if samples.taken_for_order:
            found.append(_order(name, samples))
        elif samples.sparse:
            found.append(_sparse(name, samples, name in actuators))
    found += [_burst(names, every) for names in bursts.values()]
    found += [_coarse(names, every) for names in coarse.values()]
    return found


def _worth_a_word(samples: Samples) -> bool:
    """Whether bursts are more than the few stamps that a jitter or a rounding made equal."""
    one = samples.burst
    share = one.moved / max(len(samples.time), 1) if one else 0.0
    return one is not None and (share >= MANY or (share >= SOME and one.unsure_s >= UNCERTAIN_S))


def _key(name: str, actuator: bool) -> str:
    return f"[[actuators]] of {name}" if actuator else f"[sensors.{name}]"


def _channel(names: list[str]) -> str:
    return names[0] if len(names) == 1 else "log"


def _burst(names: list[str], every: Mapping[str, Samples]) -> Finding:
    facts = [every[name].burst for name in names]
    moved = sum(one.moved for one in facts if one)
    one = facts[0]
    assert one is not None
    if one.cut_s:
        how = (
            f"in whole steps of {one.cut_s:g} s: they were spread over the step that their stamp "
            "names"
        )
    else:
        how = (
            f"as they are handed over every {one.each_s:.3g} s or so: they were spread over the "
            "time since the stamp before, and the last one stands at its stamp"
        )
    sentence = (
        f"Several samples of {listed(names)} bear one stamp, {how}. {moved} samples were moved; "
        f"their times can be off by up to {one.unsure_s:.2g} s."
    )
    return Finding("burst", _channel(names), sentence, value=round(one.unsure_s, 3), unit="s")


def _coarse(names: list[str], every: Mapping[str, Samples]) -> Finding:
    one = every[names[0]]
    sentence = (
        f"The stamps of {listed(names)} count in steps of {one.step_s:.3g} s, and a sample comes "
        f"every {one.period_s:.4g} s: a time can be off by up to {one.step_s:.3g} s. Samples up to "
        f"{one.tolerance_s:.3g} s apart are interpolated; tolerance_s in [sensors] says otherwise."
    )
    low = -round(one.step_s, 3)
    return Finding("clock_offset", _channel(names), sentence, low=low, high=0.0, unit="s")


def _dropped(name: str, samples: Samples) -> Finding:
    foreign = samples.foreign
    why = (
        "they have the stamps of others, as of two instruments under one name: look for "
        "a talker, a frame or a status that tells them apart"
        if foreign
        else "another one has the same time"
    )
    sentence = f"{samples.dropped} samples of {name} are not used: {why}."
    return Finding("dropped", name, sentence, value=float(samples.dropped), unit="samples")


def _order(name: str, samples: Samples) -> Finding:
    step = np.diff(samples.time) * 1e-9
    seen = (
        f"{name} has {len(samples.time)} samples {step.min():.2g} to {step.max():.3g} s apart, no "
        "two alike, as of an order that is sent when it changes"
    )
    key = _key(name, True)
    value = round(float(step.max()), 3)
    if samples.hold:
        sentence = (
            f'{seen}: each holds until the next one. Say so in {key} with between = "hold", or '
            'otherwise with between = "line".'
        )
        return Finding("held", name, sentence, value=value, unit="s")
    sentence = (
        f"{seen}. Nothing is interpolated over more than {samples.tolerance_s:.3g} s: if each "
        f'holds until the next one, set between = "hold" in {key}.'
    )
    return Finding("gap", name, sentence, value=value, unit="s")


def _sparse(name: str, samples: Samples, actuator: bool) -> Finding:
    order = ', or between = "hold" if it is an order' if actuator else ""
    sentence = (
        f"{name} has a sample every {samples.period_s:.3g} s, and nothing is interpolated over "
        f"more than {samples.tolerance_s:.3g} s, the longest time that this ship's motion can "
        f"bear: choose another topic, or set tolerance_s in {_key(name, actuator)}{order}."
    )
    return Finding("gap", name, sentence, value=round(samples.period_s, 3), unit="s")
