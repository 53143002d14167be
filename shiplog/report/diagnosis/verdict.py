"""The answer of a diagnosis, in the contract's words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses.hypothesis import name_of
from shiplog.diagnosis.residual.interval import Interval
from shiplog.diagnosis.residual.next_manoeuvre import Advice
from shiplog.diagnosis.residual.omitted_inputs import Dependence
from shiplog.diagnosis.verdict.result import SIDE_THRUST, Decision, Named
from shiplog.exceptions import listed
from shiplog.models.causes import Cause, Setting, si
from shiplog.nomenclature.channels import VELOCITY
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import figure
from shiplog.simulation.error_reduction import Gain

LEAST_SHARE = 0.01  # probability, below which an answer is not listed in the ranking
HOPELESS = 30.0  # realistic sizes, beyond which a cause counts as undetectable
NINETY_SPREADS = 1.645  # standard deviations to either end of a 90 % interval


@dataclass(frozen=True)
class Verdict:
    """The answer of `shiplog diagnose`.

    verdict    named, none, unknown, undecided, coverage or external
    causes     in the contract's form
    sentence   the answer in words
    without    the data that the numbers of each held-out window were fitted without
    contradictions  of the voyages' reports, while which no cause of their channels is named
    hidden     how many causes could not have shown: `of`, `causes` (their number) and `names`
    """

    verdict: str
    sentence: str
    run: str
    before_effect: bool
    made: str
    causes: tuple[dict, ...] = ()
    ranking: tuple[dict, ...] = ()
    rejected: tuple[dict, ...] = ()
    traces: tuple[dict, ...] = ()
    wrong: tuple[dict, ...] = ()
    structure: dict | None = None
    intervals: tuple[Interval, ...] = ()
    gain: Gain | None = None
    without: str = "its voyage"
    unseen: tuple[dict, ...] = ()
    limits: tuple[dict, ...] = ()
    unavailable: tuple[dict, ...] = ()
    notes: tuple[str, ...] = field(default=())
    contradictions: tuple[dict, ...] = ()
    hidden: dict | None = None

    def as_json(self) -> dict:
        found = {
            "contract": CONTRACT,
            "verdict": self.verdict,
            "sentence": self.sentence,
            "causes": list(self.causes),
            "ranking": list(self.ranking),
            "rejected": list(self.rejected),
            "traces": list(self.traces),
            "wrong": list(self.wrong),
            "intervals": [i.as_json() for i in self.intervals],
            "unseen": list(self.unseen),
            "limits": list(self.limits),
            "unavailable": list(self.unavailable),
            "explained": max(self.gain.reduction, 0.0) if self.gain and self.causes else 0.0,
            "notes": list(self.notes),
            "contradictions": list(self.contradictions),
            "not_shown": self.hidden or {"causes": 0, "of": 0, "names": []},
            "base": {"run": self.run, "before_effect": self.before_effect},
        }
        if self.structure is not None:
            found["structure"] = self.structure
        if self.gain is not None:
            found["gain"] = self.gain.as_json()
        return found


DEPENDS = {
    "position": ("x0", "y0"),
    "heading": ("heading",),
    "time": ("time",),
    "motion": ("surge", "sway", "yaw_rate"),
    "wind": ("wind_speed", "wind_angle"),
    "stochastic": (),
    "intermittent": ("time",),
}


def cause_json(named: Named, advice: Advice | None = None) -> dict:
    estimates = named.estimates
    alike = list(dict.fromkeys(name_of(label) for label in named.alike))
    content = {
        "name": named.cause.name,
        "probability": min(max(named.probability, 0.0), 1.0),
        "parameters": {k: v.as_json() for k, v in estimates.items()} | _which(named),
        "sentence": named.cause.sentence(estimates),
        "equation": equation(named),
        "indistinguishable_from": alike,
    }
    if math.isfinite(named.evidence):  # chosen on whole windows, it has none
        content["evidence_nats"] = named.evidence
    tests = [named.cause.separated_by[n] for n in alike if n in named.cause.separated_by]
    if alike:
        content["next_test"] = "; ".join(dict.fromkeys(tests)) or (
            advice.words if advice else "the same manoeuvres again, with turns both ways and stops"
        )
    if advice is not None:
        content["next_test_expected"] = {
            "manoeuvre": advice.words, "seconds": advice.seconds, "nats": advice.nats,
        }  # fmt: skip
    if named.cause.user:
        content["user"] = True
    return content


WHICH = ("channel", "actuator")  # the part of a cause's label after the colon


def _which(named: Named) -> dict:
    found = {key: getattr(named.cause, key, "") for key in WHICH}
    return {
        key: {"value": value, "low": value, "high": value, "unit": ""}
        for key, value in found.items()
        if value
    }


def equation(named: Named) -> str:
    """The equation with its numbers, of the fit and of the contract's parameters."""
    values = {p.name: float(v) for p, v in zip(named.cause.parameters, named.numbers, strict=False)}
    values |= {k: v.value for k, v in named.estimates.items()}
    return named.cause.equation.format(**values)


def side_force_json(decision: Decision, times: Sequence[dict]) -> dict:
    """An unrecorded thruster. `times`: voyage, start_s, end_s, force_N, sd_N."""
    found = decision.side_force
    assert found is not None
    strongest = max(times, key=lambda t: abs(t["force_N"]), default=None)
    peak, sd = (found.force, found.force) if strongest is None else (
        abs(strongest["force_N"]), strongest["sd_N"],
    )  # fmt: skip
    low, high = max(peak - NINETY_SPREADS * sd, 0.0), peak + NINETY_SPREADS * sd
    size = {"value": peak, "low": low, "high": high, "unit": "N"}
    where = "ahead of" if found.lever >= 0.0 else "abaft"
    return {
        "name": SIDE_THRUST,
        "probability": min(decision.ranking[SIDE_THRUST], 1.0),
        "parameters": {"force": size},
        "times": list(times),
        "sentence": (
            f"An intermittent side force of up to {figure(peak)} N acts "
            f"{figure(abs(found.lever))} m {where} midship and is not recorded: a thruster, or an "
            "external force."
        ),
        "equation": "Y + F(t), N + x F(t)",
        "indistinguishable_from": [],
        "evidence_nats": found.gain,
    }


def trace_json(named: Named) -> dict:
    """A cause that is present, but too small to matter."""
    return {
        "name": named.cause.name,
        "parameters": {k: v.as_json() for k, v in named.estimates.items()} | _which(named),
        "sentence": f"Present, but below practical size: {named.cause.sentence(named.estimates)}",
    }


def structure_json(decision: Decision, actuators: Sequence[str]) -> dict | None:
    found = decision.structure
    if found is None:
        return None
    depends = tuple(actuators) if found.family == "controls" else DEPENDS[found.family]
    return {
        "family": found.family, "acts_on": list(found.acts_on), "depends_on": list(depends),
        "evidence_nats": found.evidence,
    }  # fmt: skip


def probabilities_json(ranking: Mapping[str, float]) -> tuple[dict, ...]:
    """Every answer with a probability of at least LEAST_SHARE, likeliest first."""
    kept = [(n, p) for n, p in ranking.items() if p >= LEAST_SHARE]
    return tuple(
        {"name": n, "probability": min(p, 1.0)} for n, p in sorted(kept, key=lambda pair: -pair[1])
    )


def limits_json(decision: Decision, causes: Sequence[Cause], setting: Setting) -> tuple[dict, ...]:
    """The smallest size of each cause that these data would reveal, best determined first: of each
    number alone, and as a share of the realistic size. Undetectable numbers are left out."""
    by, nats = {c.label: c for c in causes}, thresholds.SHOWS_NATS
    found = []
    for label, expected in decision.expected.items():
        cause, least = by[label], expected.least(nats)
        if cause.special:
            continue
        sizes = least * cause.sizes(setting)
        if cause.parameters:  # its sizes begin with theirs; uncertain factors may follow
            parts = zip(cause.parameters, sizes, least, strict=False)
            numbers = {p.name: (v / si(p.unit), p.unit) for p, v, of in parts if of < HOPELESS}
        else:  # a number for each rudder, or for each point of the map
            numbers = cause.displayed(sizes)
        numbers = {k: {"value": float(v), "unit": unit} for k, (v, unit) in numbers.items()}
        found.append(
            {
                "name": cause.name,
                "share": expected.together(nats),
                "parameters": numbers,
            }
        )
        if label != cause.name:
            key = next((k for k in WHICH if getattr(cause, k, "")), "channel")
            found[-1][key] = label.partition(":")[2]
    return tuple(sorted(found, key=lambda one: one["share"]))


def not_shown(limits: Sequence[dict]) -> dict:
    """How many of the causes in the table of smallest sizes could not have shown at any realistic
    size: `causes` of `of`, with their `names`."""
    names = [
        f"{one['name']} ({which})" if (which := next((one[k] for k in WHICH if k in one), ""))
        else one["name"]
        for one in limits
        if one["share"] >= HOPELESS
    ]  # fmt: skip
    return {"causes": len(names), "of": len(limits), "names": names}


def unseen_json(row: Dependence) -> dict:
    """One row of the table of inputs that the model does not have."""
    r2 = dict(zip((c.name for c in VELOCITY), row.r2, strict=True))
    text = ", ".join(f"{k.replace('_', ' ')} {v:.2f}" for k, v in r2.items())
    depends = f"acts on {listed(row.acts_on)}" if row.significant else "no dependence"
    return {
        "variable": row.variable, "r2": r2, "acts_on": list(row.acts_on),
        "significant": row.significant, "left_out": row.folds,
        "sentence": f"R² {text} ({row.folds} left out): {depends}",
    }  # fmt: skip


def rejected_json(reasons: Mapping[str, str]) -> tuple[dict, ...]:
    """Label → reason. Of a cause with several channels, the reason begins with the channel."""
    found = []
    for label, why in reasons.items():
        name, _, channel = label.partition(":")
        found.append({"name": name, "reason": f"{channel}: {why}" if channel else why})
    return tuple(found)
