"""What a diagnosis reported, in a few lines; and profiles that differ in one thing."""

from __future__ import annotations

import json
import logging
import time
import tomllib
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path

import tomli_w

from shiplog.commands.diagnose import diagnose_run
from shiplog.voyages.store.store import Store

log = logging.getLogger(__name__)


def diagnosed(
    run: Path,
    store: Store,
    names: Sequence[str],
    out: Path,
    what: str,
) -> str:
    """The verdict in a few lines, made unless it is there."""
    if not (out / "verdict.json").exists():
        began = time.monotonic()
        diagnose_run(run, store, names, out)
        log.info("%s: %.0f s", out.name, time.monotonic() - began)
    reported = json.loads((out / "verdict.json").read_text("utf-8"))
    lines = [f"## {run.name}, {what}", "", f"{reported['verdict']}: {reported['sentence']}", ""]
    for cause in reported["causes"]:
        lines.append(f"- {cause['name']}: {parameters(cause['parameters'])}")
    gain = reported.get("gain")
    if gain:
        lines.append(
            f"- held out: L {gain['before']:.0f} to {gain['after']:.0f}, "
            f"{gain['reduction']:.0%} less ({gain['low']:.0%} to {gain['high']:.0%}), "
            f"{gain['held_out_windows']} windows"
        )
    lines += [f"- rejected {r['name']}: {r['reason']}" for r in reported["rejected"]]
    lines += [f"- trace {t['name']}: {t['sentence']}" for t in reported["traces"]]
    lines += [
        f"- {i['kind']}: {i['voyage']} {i['start_s']:.0f} to {i['end_s']:.0f} s: {i['sentence']}"
        for i in reported["intervals"]
        if i["kind"] == "external"
    ]
    lines += [
        f"- not seen by the model, {u['variable']}: {u['sentence']}"
        for u in reported["unseen"]
        if u["significant"]
    ]
    lines += [f"- {note}" for note in reported.get("notes", ())]
    return "\n".join(lines)


def parameters(reported: dict) -> str:
    """A cause's numbers with their 90 % intervals and units, in a line. A ratio has three decimals:
    an interval about 1 is often narrower than a hundredth."""
    return ", ".join(
        f"{name} {_number(p, 'value')} ({_number(p, 'low')} to {_number(p, 'high')}) "
        f"{unit(p)}".strip()
        if not isinstance(p["value"], str)
        else f"{name} {p['value']}"
        for name, p in reported.items()
    )


def _number(parameter: dict, which: str) -> str:
    return f"{parameter[which]:{'.3f' if parameter['unit'] == '1' else '.3g'}}"


def unit(parameter: dict) -> str:
    """As it is written after a number; of a bare one nothing."""
    return "" if parameter["unit"] == "1" else parameter["unit"]


def variant(profile: str, path: Path, edit: Callable[[dict], None]) -> Path:
    """A shipped profile, changed, as a file."""
    shipped = resources.files("shiplog") / "profiles"
    content = tomllib.loads((shipped / f"{profile}.toml").read_text("utf-8"))
    edit(content)
    path.write_text(tomli_w.dumps(content), encoding="utf-8")
    coefficients = shipped / f"{profile}.mmg.toml"
    if coefficients.is_file():
        path.with_suffix(".mmg.toml").write_text(coefficients.read_text("utf-8"), "utf-8")
    return path
