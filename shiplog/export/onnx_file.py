"""`--to onnx`: a network with its scaling, from SI inputs to accelerations in SI.

    velocity [N, 3], actuator [N, A], wind [N, 2] (apparent: speed, angle) -> acceleration [N, 3]

ν̇ = σ_acc · f_NN(s) + μ_acc with s the standardised (ν, u, ω): Eqs. 20-22 of the paper.
"""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from shiplog.exceptions import ModelError
from shiplog.export.job import Job
from shiplog.export.not_loaded import NotLoaded
from shiplog.export.trial import SECONDS, Difference, difference_of_rows
from shiplog.machine import files
from shiplog.models import NETWORK
from shiplog.nomenclature.channels import VELOCITY_IN_STATE
from shiplog.simulation.window_series import apparent_wind

CONSUMER = "ONNX Runtime"
OPSET = 17  # of 2022: every runtime of the last years has it
IR = 8  # of the file's form, of the same time
OUTPUT = "acceleration"


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    """Raises ModelError for what is no network, and NotLoaded without `onnx`, which writes it."""
    network = _network(job)
    try:
        import onnx
        from onnx import TensorProto, helper
    except ImportError as error:
        raise ModelError(
            "The library onnx is not installed, which writes the file.",
            hint="pip install 'shiplog[export]'",
        ) from error
    profile = job.run.profile
    widths = {"velocity": 3, "actuator": len(profile.actuators)} | (
        {"wind": 2} if profile.has_wind else {}
    )
    known: list[Any] = []
    nodes = _nodes(network, list(widths), known, helper)
    double = TensorProto.DOUBLE
    graph = helper.make_graph(
        nodes, job.ship.identifier,
        [helper.make_tensor_value_info(n, double, ["N", w]) for n, w in widths.items()],
        [helper.make_tensor_value_info(OUTPUT, double, ["N", 3])], known,
    )  # fmt: skip
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR)
    made.producer_name, made.producer_version = "shiplog", job.ship.author.removeprefix("shiplog ")
    made.doc_string = " ".join(record)
    facts = {
        "run": job.run.name, "ship": profile.ship.name, "step_s": repr(job.ship.step),
        "velocity": "surge, sway (m/s), yaw rate (rad/s), through the water, midship",
        "actuator": json.dumps({i.name: i.unit for i in job.ship.inputs}),
        "wind": "apparent: speed (m/s), where it comes from, from ahead to starboard (rad)",
        OUTPUT: "m/s2, m/s2, rad/s2; Euler steps of step_s", "compared": " ".join(record),
    }  # fmt: skip
    helper.set_model_props(made, facts)
    onnx.checker.check_model(made)
    with files.whole(path) as partial:
        partial.write_bytes(made.SerializeToString())


def _network(job: Job) -> Any:
    run = job.run
    if run.kind.family is not NETWORK or run.extension is not None:
        what = "has causes added to it" if run.extension is not None else "is no network"
        raise ModelError(
            f"{run.name} {what}: ONNX is for the weights of networks.",
            hint="--to fmu, cpp, python and mss have its equations.",
        )
    return run.simulator(run.config.seeds[0])


def _nodes(network: Any, inputs: list[str], known: list[Any], helper: Any) -> list[Any]:
    from onnx import numpy_helper

    def constant(name: str, values: Any) -> str:
        known.append(numpy_helper.from_array(np.asarray(values, dtype=float), name))
        return name

    nodes: list[Any] = []

    def put(kind: str, given: list[str], name: str, **how: Any) -> str:
        nodes.append(helper.make_node(kind, given, [name], **how))
        return name

    parts = inputs[:2]
    if "wind" in inputs:
        speed, angle = "wind_speed", "wind_angle"
        nodes.append(helper.make_node("Split", ["wind"], [speed, angle], axis=1))
        if network.shape.wind_input == "components":
            for name, function in (("ahead", "Cos"), ("starboard", "Sin")):
                share = put(function, [angle], f"{name}_share")
                parts.append(put("Mul", [speed, share], name))
        else:
            turn = constant("turn", [2.0 * math.pi])
            turns = put("Floor", [put("Div", [angle, turn], "share_of_turn")], "turns")
            positive = put("Sub", [angle, put("Mul", [turns, turn], "whole_turns")], "positive")
            parts += [speed, positive]
    scale = network.scaling
    hidden = put("Concat", parts, "inputs", axis=1)
    hidden = put("Sub", [hidden, constant("input_mean", scale.input_mean)], "centred")
    hidden = put("Div", [hidden, constant("input_std", scale.input_std)], "standardised")
    if network.shape.input_tanh:
        hidden = put("Tanh", [hidden], "bounded")
    weights = [w.detach().double().numpy() for w in network.weights]
    pairs = list(zip(weights[::2], weights[1::2], strict=True))
    for i, (w, b) in enumerate(pairs):
        given = [hidden, constant(f"weight{i}", w), constant(f"bias{i}", b)]
        hidden = put("Gemm", given, f"layer{i}", transB=1)
        if i < len(pairs) - 1:
            hidden = put("Tanh", [hidden], f"hidden{i}")
    hidden = put("Mul", [hidden, constant("output_std", scale.output_std)], "scaled")
    put("Add", [hidden, constant("output_mean", scale.output_mean)], OUTPUT)
    return nodes


def losses(job: Job) -> tuple[str, ...]:
    _network(job)
    return (
        f"The way from accelerations to states: Euler's steps of {job.ship.step:g} s.",
        "Rates of the actuators, wind over ground and current: inputs are as they act.",
        *job.ship.losses,
    )


def compare(job: Job, path: Path) -> Difference:
    """Sailed as `simulate` does with the file's accelerations. Raises NotLoaded without ONNX
    Runtime."""
    try:
        import onnxruntime
    except ImportError as error:
        raise NotLoaded("onnxruntime is not installed (pip install 'shiplog[export]')") from error
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    has_wind = job.run.profile.has_wind

    def rates(state: np.ndarray, actuator: np.ndarray, wind: np.ndarray) -> np.ndarray:
        given = {"velocity": state[:, list(VELOCITY_IN_STATE)], "actuator": actuator}
        if has_wind:
            given["wind"] = apparent_wind(state, wind)
        return np.asarray(session.run([OUTPUT], given)[0])

    trial = job.trial
    twin = copy.copy(job.sailor)
    # a copy that asks the file, and no other model, for its accelerations
    twin.rates = lambda count, rng=None: rates  # type: ignore[method-assign]
    sailed, _ = twin.sail(trial.schedule, members=1, water=trial.water, seconds=SECONDS)
    return difference_of_rows(trial, sailed.state[0])


def version() -> str:
    try:
        import onnxruntime
    except ImportError:
        return ""
    return onnxruntime.__version__
