"""Commands on short voyages of the simulated ship, as a user types them."""

import json

from commands import call

HULL = ("--without", "propeller", "--without", "rudder")  # a hull in the wind compiles quickly
WINDOW = ("--window", 25)
BOTH = ("--voyages", "trip_1", "--voyages", "trip_2")
STATES = ["x0", "surge", "y0", "sway", "heading", "yaw_rate"]


def train(store, out, *arguments):
    return call("train", "--store", store, "--out", out, *WINDOW, *arguments)


def answer(path):
    return json.loads(path.read_text(encoding="utf-8"))


def scored(run, store, to) -> dict:
    assert call("evaluate", run, "--store", store, "--voyages", "trip_3", "--json", to)[0] == 0
    return answer(to)
