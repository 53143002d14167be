"""Which voyages train, validate and test: whole voyages, never parts of one on both sides."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import polars as pl

from pipelines.prepare import seconds
from shiplog import table, windows
from shiplog.config import AUGMENTATIONS, Split
from shiplog.exceptions import StoreError, listed
from shiplog.store import Store

log = logging.getLogger(__name__)

PAPER_TRAINING = {"d-ref": 4}  # Table 4: voyages 1 to 4; every other dataset 1 and 2
SAMPLE_VOYAGES = tuple(f"voyage_{i}" for i in range(1, 7))
HELD_OUT_SHARE = 0.15  # of the seconds, for validation and for test each


def choose_split(
    store: Store, voyages: Sequence[str], validation: Sequence[str], data: str, size: int
) -> Split:
    """Which voyages train, validate and test; what the user did not say is chosen, and said.

    Six voyages in order, or the sample logs, are split as in the paper; else whole voyages are
    dealt out in order of time, about 15 % of the seconds each to validation and test.
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
            chosen_by="the paper's Table 4, voyages 1 to 6 in order",
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
    rows = seconds(store, names, profile)
    whole = plan(rows, "ref", size).group_by("voyage").len()
    counts = dict(whole.iter_rows())
    first = dict(rows.group_by("voyage").agg(pl.col("time").min()).iter_rows())
    usable = sorted((n for n in names if n in counts), key=lambda n: (first[n], n))
    twin = {}  # the same data under two names stays on one side
    for left, right, _ in table.shared_rows(rows).iter_rows():
        twin[right] = twin.get(left, left)
    groups: dict[str, list[str]] = {}
    for name in usable:
        groups.setdefault(twin.get(name, name), []).append(name)
    if len(groups) < 2:
        raise StoreError(
            f"{len(groups)} voyage(s) with a window of {size} s cannot be split into training and "
            f"validation.",
            hint="ingest at least two voyages, or choose a shorter --window.",
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


def say(split: Split) -> None:
    """What was chosen, on the progress log."""
    log.info(
        "split by %s: training %s; validation %s; test %s",
        split.chosen_by,
        listed(split.training),
        listed(split.validation),
        listed(split.test),
    )


def refuse_shared_rows(rows: pl.DataFrame, split: Split) -> None:
    """The same seconds in training and validation make the validation worthless: refuse."""
    for left, right, count in table.shared_rows(rows).iter_rows():
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
