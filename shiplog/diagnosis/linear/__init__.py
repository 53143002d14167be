"""Segments, and the model linearised about each.

A segment s has B observations y_b, means over bins of the state x = (x₀, u, y₀, v, ψ, r) [6] in
`channels.STATE`'s order. The model with coefficients θ, driven by actuators and true wind u(t), is

    ẋ₀ = u cos ψ - v sin ψ,   ẏ₀ = u sin ψ + v cos ψ,   ψ̇ = r
    (u̇, v̇, ṙ) = f(x, u(t); θ) + Σⱼ hⱼ(t) aⱼ

with an acceleration that the model has not: aⱼ [3] at node j, hⱼ the hat functions of J nodes, so
that it is straight in between. A path x* starts at ξ* and has accelerations a*: both are fitted
to the measurement (`linearisation.fit_path`), as a path from a measured state alone soon leaves it.
About that path and θ*, with the simulated means y*, what is simulated and what is read are linear:

    y_s + O_s (θ - θ*) = y_s* + H_s (θ - θ*) + Z_s (z_s - z_s*) + ε_s
    e_s = J_s d + Z_s z_s + ε_s,   J_s = H_s - O_s,   d = θ - θ*
    e_s = y_s - y_s* + Z_s (0, a*)                          `linearisation.linear`

    z_s [6 + 3J]         (δξ, a): the start less ξ*, and the accelerations; z_s* = (0, a*)
    Z_s [6B, 6 + 3J]     ∂y*/∂z, H_s [6B, C] ∂y*/∂θ       `variational_equations.columns`
    O_s [6B, C]          ∂y/∂θ: how causes change what was read  `measurement_correction.read`

θ [C] holds the model's P coefficients, then each cause's numbers (`parameter_layout.Columns`). A
discrepancy with weights w [W] accelerates the ship by Φ_s w at the nodes (`segment_nodes`); with
Z_s = (Z₀ | Zₐ) by start and accelerations it adds the term Zₐ Φ_s w. In a shape, J is the number
of nodes; J_s, or J where e has no index, is the matrix of sensitivities.
"""
