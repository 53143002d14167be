"""Results on disk whose pages have answers that are worked out by hand.

The ship sails north at 1 m/s for 100 s. The model before drifts east by 0.1 m/s, the model after by
0.01 m/s, so that after 99 s they are 9.9 m and 0.99 m off. Voyages have a name that a stranger
chose.
"""

import json

import numpy as np
import polars as pl

from shiplog.report.figures import picture_data
from shiplog.report.figures.picture_data import AFTER, BEFORE, MEASURED, PictureData, typed

HOSTILE = "trial <script>alert(1)</script> & 'one' \\textbf{x}"
LENGTH = 4.95  # m: the model before ends two lengths off
DRIFT = {MEASURED: 0.0, BEFORE: 0.1, AFTER: 0.01}  # m/s to the east
LOSS = {BEFORE: 800.0, AFTER: 200.0}


def states(model, voyage, window, begin=0.0, seconds=100):
    time = np.arange(float(seconds))
    zero = np.zeros(seconds)
    return pl.DataFrame(
        {
            "model": [model] * seconds, "voyage": [voyage] * seconds, "window": [window] * seconds,
            "time": begin + time, "x0": begin + time, "surge": zero + 1.0,
            "y0": DRIFT[model] * time, "sway": zero, "heading": zero, "yaw_rate": zero,
        }
    )  # fmt: skip


def pictures(voyages=(HOSTILE,), windows=1, latitude=34.8):
    tracks, measured, errors, residual = [], [], [], []
    for voyage in voyages:
        for window in range(windows):
            begin = 100.0 * window
            for model in (MEASURED, BEFORE, AFTER):
                tracks.append(states(model, voyage, window, begin))
            measured.append(tracks[-3].drop("model", "window"))
            errors += [
                {"model": m, "voyage": voyage, "window": window, "time": begin, "seconds": 99.0,
                 "loss": LOSS[m]}
                for m in (BEFORE, AFTER)
            ]  # fmt: skip
        node = np.arange(0.0, 100.0 * windows, 2.0)
        for channel in ("surge", "sway", "yaw_rate"):
            residual.append(pl.DataFrame({
                "voyage": [voyage] * len(node), "time": node, "channel": [channel] * len(node),
                "force": np.full(len(node), 3.0), "sd": np.full(len(node), 0.5),
                "named": np.full(len(node), 2.0),
            }))  # fmt: skip
    rows = pl.DataFrame({
        "voyage": list(voyages), "start": ["2026-04-14T02:00:00+00:00"] * len(voyages),
        "seconds": [100.0 * windows] * len(voyages), "latitude": [latitude] * len(voyages),
        "longitude": [135.5 if latitude is not None else None] * len(voyages),
        "wind_speed": [5.0] * len(voyages), "wind_from": [np.pi / 2] * len(voyages),
    })  # fmt: skip
    conditions = pl.DataFrame({
        "campaign": ["trial", "trial", "training"], "speed": [1.0, 1.0, 1.0],
        "drift": [0.0, 0.2, 0.0], "yaw_rate": [0.0, 0.02, 0.0], "wind_speed": [5.0, 5.0, 4.0],
        "wind_from": [np.pi / 2, np.pi / 2, 0.0],
    })  # fmt: skip
    at = 100.0 * windows * np.arange(len(voyages))
    acting = pl.DataFrame({
        "cause": ["current"] * len(voyages), "voyage": list(voyages), "begin": at,
        "end": at + 100.0 * windows, "probability": np.full(len(voyages), 0.9),
    })  # fmt: skip
    return typed(PictureData(
        title="by hand", length=LENGTH, breadth=0.5, models={BEFORE: "mmg", AFTER: "mmg, with it"},
        named=("current",), current=(0.5, np.pi), voyages=rows, measured=pl.concat(measured),
        tracks=pl.concat(tracks), errors=pl.DataFrame(errors), residual=pl.concat(residual),
        conditions=conditions, acting=acting,
    ))  # fmt: skip


def cause(value=0.1, low=0.09, high=0.11):
    unit = "m/s"
    return {
        "name": "current", "probability": 0.97,
        "parameters": {"speed": {"value": value, "low": low, "high": high, "unit": unit}},
        "sentence": "A steady current.", "equation": "ν̇ = f(ν - RᵀV)", "remedy": "Measure it.",
        "indistinguishable_from": [],
    }  # fmt: skip


def verdict(word="named", voyages=(HOSTILE,), **changed):
    named = word == "named"
    found = {
        "contract": 1, "verdict": word, "sentence": "By hand.",
        "causes": [cause()] if named else [],
        "ranking": [{"name": "current" if named else "none", "probability": 0.97},
                    {"name": "unknown:motion", "probability": 0.03}],
        "rejected": [{"name": "payload", "reason": "log Bayes factor -2 nats"},
                     {"name": "clock_offset", "reason": "gnss: no gain"}],
        "traces": [{"name": "rudder_lag", "parameters": {}, "sentence": "Below practical size."}],
        "wrong": [{"channel": "sway", "share_of_error": 0.75, "where": "everywhere"},
                  {"channel": "surge", "share_of_error": 0.25, "where": "nowhere"}],
        "intervals": [{"voyage": voyages[0], "start_s": 10.0, "end_s": 30.0, "kind": "external",
                       "sentence": "Pushed."}],
        "unseen": [], "limits": [
            {"name": "current", "share": 0.2,
             "parameters": {"north": {"value": 0.02, "unit": "m/s"}}},
            {"name": "wind_force", "share": 2.0,
             "parameters": {"sway_factor": {"value": 1.4, "unit": "1"}}},
            {"name": "fouling", "share": 0.5,
             "parameters": {"factor": {"value": 0.3, "unit": "1"}}},
        ],
        "unavailable": [{"name": "bank", "reason": "the profile's [site] shows no bank"}],
        "explained": 0.75 if named else 0.0, "notes": ["A note."], "contradictions": [],
        "not_shown": {"causes": 0, "of": 3, "names": []},
        "base": {"run": "mmg", "before_effect": True},
        "subject": {
            "ship": "ship by hand", "length_m": LENGTH, "run": "mmg", "model": "MMG",
            "made": "fitted to earlier voyages", "trained_on": ["voyage_1"],
            "voyages": [{"name": v, "start": "2026-04-14T02:00:00+00:00", "seconds": 100.0}
                        for v in voyages],
            "window_s": 100, "shiplog": "0.1.0",
        },
    }  # fmt: skip
    if named:
        found["gain"] = {
            "before": 800.0, "after": 200.0, "reduction": 0.75, "low": 0.7, "high": 0.8,
            "held_out_windows": 1, "channels": {"sway": 0.8, "surge": 0.6},
        }  # fmt: skip
    return found | changed


def folder(path, content=None, data=None, **provenance):
    """As `diagnose` writes it."""
    path.mkdir(parents=True)
    (path / "verdict.json").write_text(json.dumps(content or verdict()), encoding="utf-8")
    facts = {"run_path": "runs/mmg", "store_path": "store"} | provenance
    (path / "provenance.json").write_text(json.dumps(facts), encoding="utf-8")
    picture_data.save(data or pictures(), path / picture_data.FOLDER)
    return path
