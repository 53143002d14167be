"""Which voyages train, validate and test: whole voyages, or parts of the only one by time."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import polars as pl

from shiplog.exceptions import StoreError, listed
from shiplog.nomenclature.channels import LEAST_WINDOW
from shiplog.voyages.rows import one_hertz
from shiplog.voyages.store.parts import Part
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.augmentation import AUGMENTATIONS
from shiplog.voyages.windows.split_settings import Split

log = logging.getLogger(__name__)

PAPER_TRAINING = {"d-ref": 4}  # Table 3: voyages 1 to 4; every other dataset 1 and 2
SAMPLE_VOYAGES = tuple(f"voyage_{i}" for i in range(1, 7))
HELD_OUT_SHARE = 0.15  # of windows, or of one voyage's seconds; for validation and for test each
# s, windows that may be proposed instead
SHORTER_WINDOWS = (80, 60, 50, 40, 30, 20, 10, LEAST_WINDOW)


def choose_split(
    store: Store, voyages: Sequence[str], validation: Sequence[str], data: str, size: int
) -> Split:
    """Which voyages train, validate and test; what the user did not name is chosen, and reported.

    Six voyages in order, or the sample logs, are split as in the paper; else whole voyages are
    dealt out in order of time, about 15 % of the windows each to validation and test.
    """
    names = store.select(list(voyages) or None)
    if validation:
        held = store.select(list(validation))
        training = tuple(n for n in names if n not in held)
        if not training:
            raise StoreError(
                "Every training voyage is also a validation voyage.",
                hint="name other voyages with --voyages.",
            )
        return Split(training=training, validation=tuple(held), chosen_by="the user")
    if not voyages and set(SAMPLE_VOYAGES) <= set(names):
        names = list(SAMPLE_VOYAGES)
    if len(names) == 6 and (voyages or names == list(SAMPLE_VOYAGES)):
        count = PAPER_TRAINING.get(data, 2)
        return Split(
            training=tuple(names[:count]),
            validation=(names[4],),
            test=(names[5],),
            chosen_by="the paper's Table 3, voyages 1 to 6 in order",
        )
    return _deal(store, names, size)


def choose_physical_split(
    store: Store, voyages: Sequence[str], validation: Sequence[str], data: str, size: int
) -> Split:
    """For a model that holds voyages out by itself: every voyage the user names is trained on.

    With none named, the sample logs' test voyage, or a share of the voyages, is left for testing.
    """
    if validation or not voyages:
        split = choose_split(store, voyages, validation, data, size)
        if validation:
            return split
        if split.training[0] in SAMPLE_VOYAGES:  # the very voyages that the network learns from
            return split
        return split.model_copy(
            update={"training": (*split.training, *split.validation), "validation": ()}
        )
    return Split(
        training=tuple(store.select(list(voyages))),
        validation=(),
        chosen_by="the user; whole voyages are held out in turn",
    )


def _deal(store: Store, names: list[str], size: int) -> Split:
    profile = store.profile(names)
    profile.require_actuators()
    rows = store.seconds(names, profile)
    whole = plan(rows, "ref", size).group_by("voyage").len()
    counts = dict(whole.iter_rows())
    first = dict(rows.group_by("voyage").agg(pl.col("time").min()).iter_rows())
    usable = sorted((n for n in names if n in counts), key=lambda n: (first[n], n))
    twin = one_hertz.twins(rows)  # the same data under two names stays on one side
    groups: dict[str, list[str]] = {}
    for name in usable:
        groups.setdefault(twin.get(name, name), []).append(name)
    _say_what_is_left_out(rows, names, usable, size)
    if len(groups) == 1:
        return _in_time(rows, store, usable[0], size)
    if not groups:
        raise StoreError(
            f"No voyage has a window of {size} s without a gap.",
            hint=proposed(rows, size)
            or "ingest the logs again: `shiplog ingest` reports what makes rows unusable.",
        )
    sides: dict[str, list[str]] = {"training": [], "validation": [], "test": []}
    taken = dict.fromkeys(sides, 0)
    want = {"validation": HELD_OUT_SHARE, "test": HELD_OUT_SHARE if len(groups) > 2 else 0.0}
    left = len(groups)
    for members in groups.values():
        weight = sum(counts[m] for m in members)
        total = sum(taken.values()) + weight
        lacking = [s for s in ("validation", "test") if want[s] and not taken[s]]
        behind = [s for s in ("validation", "test") if taken[s] < want[s] * total]
        side = "training"
        if taken["training"] and (behind or left <= len(lacking)):
            side = (lacking or behind)[0] if left <= len(lacking) else behind[0]
        sides[side] += members
        taken[side] += weight
        left -= 1
    return Split(
        **{side: tuple(members) for side, members in sides.items()},
        chosen_by="whole voyages dealt out in order of time",
    )


def _in_time(rows: pl.DataFrame, store: Store, name: str, size: int) -> Split:
    """One voyage, or a part of one, by time: what comes first trains, what comes last tests.
    Windows are cut in each part by itself, so that none crosses."""
    own = rows.filter(pl.col("voyage") == name)
    # parts count from the first row, which may be long before the first usable one
    elapsed = own["elapsed"].to_numpy()
    used = np.arange(1, len(elapsed) + 1) / len(elapsed)  # share of the usable seconds
    ends = [1.0 - 2.0 * HELD_OUT_SHARE, 1.0 - HELD_OUT_SHARE]
    at = [0, *(int(elapsed[np.searchsorted(used, end)]) for end in ends), int(elapsed[-1]) + 1]
    of = store.part_of(name) or Part(name, 0, at[-1])
    at[-1] = min(at[-1], of.end - of.begin)
    named = [str(Part(of.whole, of.begin + a, of.begin + b)) for a, b in pairwise(at) if a < b]
    longest = [
        _longest(own.filter(pl.col("elapsed").is_between(a, b, closed="left")))
        for a, b in pairwise(at)
    ]
    if len(named) < 3 or min(longest) < size:
        shorter = f"choose --window {min(longest)} or shorter, or "
        raise StoreError(
            f"{name} is the only voyage with a window of {size} s, and too short to be split in "
            f"time: the {', '.join(map(str, longest))} s in a row that are to train, validate and "
            "test do not all hold one.",
            hint=f"{shorter if min(longest) >= LEAST_WINDOW else ''}ingest a second voyage.",
        )
    return Split(
        training=(named[0],), validation=(named[1],), test=(named[2],),
        chosen_by="time, since there is but one voyage: the first part trains, the last one tests",
    )  # fmt: skip


def _longest(seconds: pl.DataFrame) -> int:
    """Seconds of the longest stretch without a missing one."""
    return max(seconds.group_by("segment").len()["len"].to_list(), default=0)


def _say_what_is_left_out(
    rows: pl.DataFrame, names: Sequence[str], usable: Sequence[str], size: int
) -> None:
    left = [name for name in names if name not in usable]
    if left and usable:
        log.info(
            "left out, without a window of %d s: %s. %s", size, listed(left), proposed(rows, size)
        )


def proposed(rows: pl.DataFrame, size: int) -> str:
    """Which shorter window more voyages have; empty where none has one."""
    longest = rows.group_by("voyage", "segment").len().group_by("voyage").agg(pl.col("len").max())
    lengths = longest["len"].to_numpy()
    now = int((lengths >= size).sum())
    shorter = [w for w in SHORTER_WINDOWS if w < size and (lengths >= w).sum() > now]
    if not shorter:
        return ""
    best = max(shorter, key=lambda w: (int((lengths >= w).sum()), w))
    count = int((lengths >= best).sum())
    uses = "all" if count == len(lengths) else f"{count}"
    return (
        f"{len(lengths) - now} of {len(lengths)} voyages are shorter than {size} s; "
        f"`--window {best}` uses {uses}."
    )


def say(split: Split) -> None:
    """What was chosen, on the progress log."""
    log.info(
        "split by %s: training %s; validation %s; test %s",
        split.chosen_by,
        listed(split.training),
        listed(split.validation),
        listed(split.test),
    )


def refuse_no_test(split: Split) -> None:
    """Raises StoreError where every voyage trains or validates."""
    if not split.test:
        raise StoreError(
            f"There is no voyage left to test on: training {listed(split.training)}, validation "
            f"{listed(split.validation)}.",
            hint="ingest another voyage, leave --validation out, or name fewer with --voyages: "
            "those that neither train nor validate are the test.",
        )


def refuse_shared_rows(rows: pl.DataFrame, split: Split) -> None:
    """The same seconds in training and validation make the validation worthless: refuse."""
    for left, right, count in one_hertz.shared_rows(rows).iter_rows():
        if (left in split.training) != (right in split.training):
            raise StoreError(
                f"{left} and {right} hold {count} identical seconds, one in training, the other "
                "in validation.",
                hint="leave one of them out.",
            )


def plan(rows: pl.DataFrame, data: str, size: int) -> pl.DataFrame:
    """The planned windows of one of the paper's datasets; steps scale with the window."""
    augmentation = AUGMENTATIONS[data]
    step = max(1, augmentation.step * size // windows.SIZE)
    return windows.plan(rows.lazy(), size, step, augmentation.copies).collect()
