"""The contract's section 5, as other programs rely on it."""

CAUSES = (
    "current", "wind_force", "shallow_water", "bank", "fouling", "payload", "cross_flow_drag",
    "thrust_loss", "thrust_drift", "rudder_force", "rudder_offset", "rudder_lag",
    "rudder_delay", "side_thrust", "heading_offset", "yaw_rate_bias", "yaw_rate_scale",
    "clock_offset", "antenna_offset", "wind_direction_offset", "wind_speed_scale", "coverage",
    "external", "unknown",
)  # fmt: skip
FAMILIES = (
    "position",
    "heading",
    "time",
    "motion",
    "controls",
    "wind",
    "stochastic",
    "intermittent",
)


def shaped(v: dict) -> None:
    """The contract's section 5, as other programs rely on it."""
    assert v["contract"] == 1
    assert v["verdict"] in ("named", "none", "unknown", "undecided", "coverage", "external")
    assert (v["verdict"] == "named") == bool(v["causes"])
    for cause in v["causes"]:
        assert cause["name"] in CAUSES or cause.get("user")
        assert 0.0 <= cause["probability"] <= 1.0
        assert cause["sentence"] and cause["equation"]
        assert isinstance(cause["indistinguishable_from"], list)
        for one in cause["parameters"].values():
            assert {"value", "low", "high", "unit"} <= set(one)
            assert one["low"] <= one["value"] <= one["high"]
    for key in ("ranking", "rejected", "traces", "wrong", "intervals"):
        assert isinstance(v[key], list)
    for one in v["ranking"]:
        assert 0.0 <= one["probability"] <= 1.0
    for one in v["rejected"]:
        assert one["name"] and one["reason"]
    for one in v["wrong"]:
        assert {"channel", "share_of_error", "where"} <= set(one)
    if v["verdict"] == "unknown":
        assert v["structure"]["family"] in FAMILIES
    if (gain := v.get("gain")) is not None:
        assert {"before", "after", "reduction", "low", "high", "held_out_windows"} <= set(gain)
        assert gain["low"] <= gain["reduction"] <= gain["high"]
    assert set(v["base"]) >= {"run", "before_effect"}
