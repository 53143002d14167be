"""Verdicts against keys. A key is opened only where the verdict was sealed before and is
unchanged since."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from scipy.special import betaincinv  # scipy.stats takes a second to load

from pipelines.experiments.hidden_effects import parameters, plan
from pipelines.experiments.hidden_effects.open_answers import Open, open_answers
from pipelines.experiments.hidden_effects.parameters import Comparison
from pipelines.experiments.hidden_effects.plan import Planned
from shiplog.exceptions import ShiplogError

LEVEL = 0.9  # of the intervals of shares
FAILED = "failed"  # the verdict that stands for "no verdict came"
FIRST = 2  # answers that an undecided verdict asks to be looked at
ALIKE = 1e-6  # two probabilities no farther apart are the same
BINS = 10
LEAST_GAIN = 0.05  # of the oracle's, for a share of it to mean anything


Statement = tuple[float, bool]  # the probability that is given, and whether what it is of is true


class Sealed(ShiplogError):
    """The key stays shut: the verdict was not sealed, or is not the one that was."""


def open_key(folder: Path, key: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Verdict and key. Raises Sealed before the key is touched."""
    seal = folder / "verdict.sha256"
    if not seal.exists():
        raise Sealed(
            f"{folder} has no verdict.sha256: the key {key} is not opened.",
            hint="run the case to its end first.",
        )
    verdict = _as_sealed(
        folder / "verdict.json", key, "remove the case's folder and run the suite again."
    )
    return json.loads(verdict), json.loads(key.read_text(encoding="utf-8"))


def open_rivals(folder: Path, key: Path) -> dict[str, Any]:
    """Method → its answer; none of them where they were not asked, or nothing was sealed. Raises
    Sealed, and is to be called before the key is opened."""
    if not (folder / "rivals.sha256").exists():
        return {}
    hint = "remove rivals.json and rivals.sha256; a case that was kept can be asked again."
    return json.loads(_as_sealed(folder / "rivals.json", key, hint))["methods"]


def _as_sealed(path: Path, key: Path, hint: str) -> bytes:
    seal = path.with_suffix(".sha256").read_text(encoding="utf-8").split() or [""]
    content = path.read_bytes() if path.exists() else b""
    if hashlib.sha256(content).hexdigest() != seal[0]:
        raise Sealed(f"{path} is not what was sealed: the key {key} is not opened.", hint=hint)
    return content


@dataclass(frozen=True)
class Answer:
    """What was hidden in one case, and what was reported of it; by simpler methods, too, if asked.

    oracle   share of the held-out error that exactly what was hidden would take off; None where
             it was not asked, or has no term here
    """

    planned: Planned
    verdict: dict[str, Any]
    key: dict[str, Any]
    steps: list[dict[str, Any]]
    rivals: Mapping[str, Any] = field(default_factory=dict)
    oracle: float | None = None

    def by(self, method: str) -> Answer:
        """The same case as that rival answers it, with the probabilities that its scores give."""
        name = self.rivals[method]["answer"]
        ranking = weights(self.rivals[method].get("ranking") or ())
        cause = {"name": name}
        if name and _name(name) in ranking:
            cause["probability"] = ranking[_name(name)]
        reported = {
            "verdict": "named" if name else "none",
            "causes": [cause] if name else [],
            "ranking": [{"name": n, "probability": p} for n, p in ranking.items()],
        }
        return self.answered(reported)

    def answered(self, verdict: dict[str, Any]) -> Answer:
        """The same case with another verdict."""
        return Answer(self.planned, verdict, self.key, [])

    @property
    def abroad(self) -> bool:
        """Of a ship whose equations are not the home ship's."""
        return bool(self.planned.family)

    @property
    def word(self) -> str:
        return str(self.verdict.get("verdict"))

    @cached_property
    def hidden(self) -> tuple[str, ...]:
        return tuple(_name(cause["name"]) for cause in self.key["causes"])

    @cached_property
    def named(self) -> tuple[str, ...]:
        """Causes in the order reported; a clock of two channels is one name."""
        if self.word != "named":
            return ()
        return tuple(dict.fromkeys(_name(cause["name"]) for cause in self.reported))

    @property
    def reported(self) -> list[dict[str, Any]]:
        return self.verdict.get("causes") or []

    @property
    def kind(self) -> str:
        """none, one, two, or outside the catalogue."""
        if self.key["verdict"] == "unknown":
            return "outside"
        return ("none", "one", "two")[min(len(self.hidden), 2)]

    @property
    def size(self) -> float:
        """Of the smallest thing hidden; 1 is realistic."""
        return min((cause["size"] for cause in self.key["causes"]), default=math.nan)

    @property
    def sought(self) -> tuple[str, ...]:
        """The hidden causes that can be found: none that a network has absorbed."""
        taken = parameters.ABSORBED if self.planned.model == "feedforward" else ()
        return tuple(name for name in self.hidden if name not in taken)

    @property
    def family(self) -> str | None:
        return (self.verdict.get("structure") or {}).get("family")

    @cached_property
    def named_since(self) -> frozenset[str]:
        """The causes that by now have a name for what was hidden outside the catalogue."""
        since = parameters.NAMED_SINCE
        return frozenset(
            since[name] for name in self.hidden if self.kind == "outside" and name in since
        )

    @property
    def right(self) -> bool:
        """All of it and nothing else, each at its place; of what no cause has a name for, its
        family, or the cause that has a name for it since."""
        if self.kind == "outside" and self.word == "named":
            return bool(self.named_since) and set(self.named) == self.named_since
        if self.kind == "outside":
            return self.word == "unknown" and self.family == self.key["structure"]["family"]
        if not self.sought:
            return self.word == "none"
        return set(self.named) == set(self.sought) and not self.misplaced

    @cached_property
    def misplaced(self) -> frozenset[str]:
        """Hidden causes that are named of another thruster, or of another channel's clock."""
        truth = {_name(cause["name"]): cause["parameters"] for cause in self.key["causes"]}
        return frozenset(
            name for name in self.named
            if name in truth and parameters.elsewhere(name, truth[name], [
                one.get("parameters") or {} for one in self.reported if _name(one["name"]) == name
            ])
        )  # fmt: skip

    @property
    def misnamed(self) -> bool:
        """A cause is named that is not there, or not at its place."""
        there = {*self.hidden, *self.named_since}
        return not set(self.named) <= there or bool(self.misplaced)

    @property
    def groups(self) -> tuple[frozenset[str], ...]:
        """Of every name, with the names that the verdict cannot tell from it; without one that is
        misplaced."""
        if self.word != "named":
            return ()
        return tuple(
            frozenset(map(_name, (c["name"], *(c.get("indistinguishable_from") or ()))))
            - self.misplaced
            for c in self.reported
        )

    @property
    def truths(self) -> tuple[str, ...]:
        """What a ranking would have first: causes, `none`, or `unknown:` with the family."""
        if self.kind == "outside":
            return (f"unknown:{self.key['structure']['family']}",)
        return self.sought or ("none",)

    @cached_property
    def open(self) -> tuple[Open, ...]:
        """The answers that are left open, with their probabilities."""
        return open_answers(self.verdict)

    @property
    def likely(self) -> tuple[frozenset[str], ...]:
        """The first two of the answers left open. Of equally probable ones each has the last of
        their places: the order in which they stand decides nothing."""
        return tuple(
            labels
            for labels, p in self.open
            if sum(other >= p - ALIKE for _, other in self.open) <= FIRST
        )

    @property
    def found(self) -> bool:
        """Right; or every truth is in a group of its own that is reported, and no group is left; or
        `undecided`, and all that is true is the first or second answer."""
        if self.right:
            return True
        if self.word == "undecided":
            either = {frozenset(self.truths), self.named_since} - {frozenset()}
            return not either.isdisjoint(self.likely)
        return len(self.groups) == len(self.truths) and any(
            all(true in group for true, group in zip(order, self.groups, strict=True))
            for order in itertools.permutations(self.truths)
        )

    def probability(self, label: str) -> float | None:
        """What the verdict gives a cause, `none` or `unknown:family`; None where it gives no
        probability at all. `unknown` is sure of its own family, whatever else is ranked."""
        reported = [one for one in self.reported if self.word == "named"]
        ranking = self.verdict.get("ranking") or ()
        given = [one for one in (*reported, *ranking) if one.get("probability") is not None]
        if not given:
            return None
        if self.word == "unknown" and label.startswith("unknown:") and label[8:] != self.family:
            return 0.0
        if label in self.named:
            reported = [one for one in reported if one.get("probability") is not None]
            if own := [
                float(one["probability"]) for one in reported if _name(one["name"]) == label
            ]:
                return max(own)
        return min(1.0, sum(
            float(one["probability"]) for one in ranking
            if label in (one["name"], _name(one["name"]))
        ))  # fmt: skip

    @cached_property
    def compared(self) -> dict[str, Comparison]:
        """Hidden causes that were named, whatever else was named."""
        reported = {
            _name(cause["name"]): cause for cause in reversed(self.reported)
        }  # the first counts
        return {
            name: parameters.compare(
                name, one["parameters"], reported[name].get("parameters") or {}
            )
            for name, one in zip(self.hidden, self.key["causes"], strict=True)
            if name in self.named
        }

    @cached_property
    def statements(self) -> tuple[Statement, ...]:
        """What the verdict states with a probability, and whether it is true.

        `named` states each of its causes: that it is hidden. `unknown` states its family, `none`
        that nothing is hidden; any other verdict the first answer that it leaves open, true where
        all of that is hidden. Of several first answers, equally probable, it states each.
        """
        if self.word == "named":
            there = {*self.hidden, *self.named_since} - self.misplaced
            stated = [(self.probability(name), name in there) for name in self.named]
        elif self.word == "none" or (self.word == "unknown" and self.family):
            label = "none" if self.word == "none" else f"unknown:{self.family}"
            stated = [(self.probability(label), self.right)]
        else:
            most = max((p for _, p in self.open), default=0.0)
            there = {*self.truths, *self.named_since}
            stated = [(p, a <= there) for a, p in self.open if p >= most - ALIKE]
        return tuple((p, true) for p, true in stated if p is not None)

    @property
    def recovered(self) -> float | None:
        """Of the error cut that the truth reaches, the share that what was named does. None where
        nothing was named, or the truth itself gains next to nothing (a gyro's faults)."""
        reduction = (self.verdict.get("gain") or {}).get("reduction")
        if reduction is None or self.oracle is None or self.oracle < LEAST_GAIN:
            return None
        return reduction / self.oracle

    def step(self, name: str) -> dict[str, Any] | None:
        """One that went to its end."""
        return next((s for s in self.steps if s["step"] == name and s["rc"] in (0, 3)), None)


def attempt(steps: Sequence[Mapping[str, Any]]) -> int:
    """Which attempt this is, by the last step of the case itself; 1 where none was counted."""
    own = [step for step in steps if step["step"] != "rivals"]
    return int(own[-1].get("attempt", 1)) if own else 0


def _name(label: str) -> str:
    """`clock_offset:wind` and `unknown:position` are a name and what of it."""
    return label.partition(":")[0]


@dataclass(frozen=True)
class Score:
    suite: str
    answers: tuple[Answer, ...]
    pending: tuple[Planned, ...]  # not run to the end yet
    unmade: tuple[Planned, ...]  # the simulator failed: there is neither log nor key


def read(out: Path) -> Score:
    """Open the key of every sealed case. Raises Sealed where a verdict was changed."""
    planned = plan.load(out)
    answers, pending, unmade = [], [], []
    for one in planned.cases:
        folder, key = plan.case_folder(out, one), plan.key_path(out, one)
        if not (folder / "verdict.sha256").exists():
            pending.append(one)
            continue
        steps = json.loads((folder / "steps.json").read_text(encoding="utf-8"))
        if not made(steps):
            unmade.append(one)
        else:
            rivals, oracle = open_rivals(folder, key), _oracle(folder / "oracle.json")
            answers.append(Answer(one, *open_key(folder, key), steps, rivals, oracle))
    return Score(planned.suite, tuple(answers), tuple(pending), tuple(unmade))


def made(steps: Sequence[Mapping[str, Any]]) -> bool:
    """Whether there are logs and a key; a replay from kept logs did not write them."""
    return all(step["rc"] == 0 for step in steps if step["step"] == "logs")


def _oracle(path: Path) -> float | None:
    found = json.loads(path.read_text(encoding="utf-8"))["oracle"] if path.exists() else None
    return None if found is None else float(found["reduction"])


def clopper_pearson(hits: int, count: int, level: float = LEVEL) -> tuple[float, float]:
    """Exact interval of a share (Clopper & Pearson 1934): the ends are the shares at which as many
    hits, or as few, have a probability of (1 - level) / 2. count is at least 1."""
    tail = 0.5 * (1.0 - level)
    low = 0.0 if hits == 0 else float(betaincinv(hits, count - hits + 1, tail))
    high = 1.0 if hits == count else float(betaincinv(hits + 1, count - hits, 1.0 - tail))
    return low, high


def weights(ranking: Iterable[Mapping[str, Any]]) -> dict[str, float]:
    """Probabilities of scores in nats above `none`, whose own score is zero; all were as likely
    before. The likeliest first, channels of one name together."""
    scores = [(one["name"], float(one["score"])) for one in ranking if one["score"] is not None]
    if not scores:
        return {}
    scores.append(("none", 0.0))
    most = max(score for _, score in scores)
    total = sum(math.exp(score - most) for _, score in scores)
    found: dict[str, float] = {}
    for name, score in scores:
        label = _name(name)
        found[label] = found.get(label, 0.0) + math.exp(score - most) / total
    return dict(sorted(found.items(), key=lambda pair: -pair[1]))


def bin_of(probability: float) -> int:
    """Of ten equal ones; 0.5 less a rounding error is in the same as 0.5."""
    return min(int(probability * BINS + ALIKE), BINS - 1)


def calibration(statements: Iterable[Statement]) -> float:
    """Expected calibration error: |mean probability - share true|, a bin weighs what it holds."""
    bins: list[list[Statement]] = [[] for _ in range(BINS)]
    for probability, right in statements:
        bins[bin_of(probability)].append((probability, right))
    apart = sum(abs(sum(p - right for p, right in one)) for one in bins)
    return apart / sum(map(len, bins))
