#!/usr/bin/env bash
# vessel-manoeuvring-models 0.0.22: the rudder of its IMO manoeuvres is not the one that is asked for.
# turning_circle moves it over at `rudder_rate`, and after 360 degrees back amidships at once, so that
# what the yaw rate then does is no pull-out of a real rudder. zigzag adds the neutral rudder angle to the
# heading at which the rudder is ordered back: a 10/10 with a neutral angle of 2 degrees is executed at
# 12 degrees of heading, and its overshoots are those of a 10/12. A guess would be that the neutral angle
# moves the rudder alone, as its docstring says, and that the rate holds both ways.
#
# Seen: "zigzag 10/10: ordered back at 9.99 deg of heading, with a neutral angle of 2 deg at 11.99; turning
# circle at 2.32 deg/s: 0.15 s for the last 0.3 deg over, 35 deg back in 0.01 s".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'vessel-manoeuvring-models==0.0.22' 'numpy==2.4.6' 'pandas==3.1.1' \
  'scipy==1.17.1' 'sympy==1.14.0' 'quantities==0.16.4' 'dill==0.4.1' 'matplotlib==3.11.2' \
  'plotly==7.1.0' 'scikit-learn==1.9.1' 'statsmodels==0.15.0' 'ipython==9.18.1'
"$work/venv/bin/python" -W ignore - <<'P'
import numpy as np
import pandas as pd
from scipy.integrate import solve_ivp
from vessel_manoeuvring_models.models.IMO_simulations import turning_circle, zigzag

T, K = 3.0, -0.35  # s, 1/s; the package's rudder is positive to starboard, its heading to port


class Nomoto:
    """T r' + r = K delta at constant speed (Nomoto, 1957), as the manoeuvres call a ship."""

    control_keys = ("delta",)

    def simulate(self, df_, method, name, additional_events):
        t, delta = df_.index.to_numpy(), df_["delta"].to_numpy()

        def rates(time, state, control):
            u, v, r, x0, y0, psi = state
            turning = (K * np.interp(time, t, delta) - r) / T
            return [0.0, 0.0, turning, u * np.cos(psi), u * np.sin(psi), r]

        names = ["u", "v", "r", "x0", "y0", "psi"]
        found = solve_ivp(
            rates, (t[0], t[-1]), df_.iloc[0][names].to_numpy(float), t_eval=t, args=(None,),
            events=list(additional_events), max_step=0.1,
        )
        return pd.DataFrame(found.y.T, columns=names, index=found.t)


def ordered_back(neutral: float) -> float:
    """Heading, deg, from which the rudder of a 10/10 goes back."""
    run = zigzag(Nomoto(), u0=1.0, neutral_rudder_angle=neutral, dt=0.01, t_max=60.0, rudder_rate=5.0)
    first = np.flatnonzero(np.diff(run["delta"].to_numpy()) < 0.0)[0]
    return float(np.degrees(abs(run["psi"].iloc[first])))


usual, neutral = ordered_back(0.0), ordered_back(2.0)
circle = turning_circle(
    Nomoto(), u0=1.0, rev=10.0, twa=0.0, tws=0.0, angle=35.0, rudder_rate=2.32, dt=0.01,
    t_max=200.0, r_limit=0.02,
)
angle, time = np.degrees(circle["delta"].to_numpy()), circle.index.to_numpy()
hard = np.flatnonzero(angle > 34.99)
over = time[hard[0]] - time[np.flatnonzero(angle > 34.66)[0]]
back = time[hard[-1] + 1] - time[hard[-1]]
left = angle[hard[-1] + 1]
print(
    f"zigzag 10/10: ordered back at {usual:.2f} deg of heading, with a neutral angle of 2 deg at "
    f"{neutral:.2f}; turning circle at 2.32 deg/s: {over:.2f} s for the last 0.3 deg over, "
    f"{35.0 - left:.0f} deg back in {back:.2f} s"
)
assert abs(usual - 10.0) < 0.05 and abs(neutral - 12.0) < 0.05
assert 0.1 < over < 0.2 and left == 0.0 and back < 0.02
P
