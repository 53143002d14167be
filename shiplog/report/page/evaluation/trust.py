"""The page's section on trust: coefficients, residuals, and which of several runs is better."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from shiplog.report.evaluation import trust as words
from shiplog.report.page.blocks import Block, Fold, Grid, Items, Line, number
from shiplog.report.page.evaluation.source import Source
from shiplog.simulation.better_model import Better
from shiplog.simulation.residual_tests import ResidualTest
from shiplog.training.physics.trust import VERDICTS, from_json

TEST = ("channel", "against", "correlation", "after", "p", "verdict")


def blocks(source: Source) -> list[Block]:
    found: list[Block] = []
    sentences = [words.better_sentence(Better(**one)) for one in source.better]
    if sentences:
        found.append(Items([[one] for one in sentences]))
    for run, answer in source.answers.items():
        found += _of_run(run, answer)
    return found


def _of_run(run: str, answer: Mapping[str, Any]) -> list[Block]:
    judged = [from_json(one) for one in answer.get("trust", ())]
    tests = [_test(one) for one in answer.get("residual_tests", ())]
    lines: list[Line] = [
        [line.strip()]
        for line in (*words.coefficient_lines(run, judged), *words.residual_lines(run, tests))
    ]
    found: list[Block] = [Items(lines)] if lines else []
    if judged:
        order = sorted(judged, key=lambda one: VERDICTS.index(one.verdict))
        rows = [tuple([cell] for cell in words.cells(one)) for one in order]
        table = Grid(words.HEAD, rows, words.HEAD[2:3], words.sources(judged))
        found.append(Fold(f"Every coefficient of {run}", [table]))
    if tests:
        found.append(Fold(f"Every test of the residuals of {run}", [_tests(tests)]))
    return found


def _tests(tests: Sequence[ResidualTest]) -> Grid:
    rows = [
        ([one.channel.replace("_", " ")], [words.INPUTS.get(one.against, one.against)],
         [number(one.correlation)], [f"{one.lag_s:.0f} s"], [number(one.p)],
         ["rejected" if one.rejected else "holds"])
        for one in tests
    ]  # fmt: skip
    return Grid(TEST, rows, TEST[2:5])


def _test(one: Mapping[str, Any]) -> ResidualTest:
    return ResidualTest(**{k: v for k, v in one.items() if k not in ("rejected", "level")})
