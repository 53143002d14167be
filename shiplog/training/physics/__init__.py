"""Identification of a physical model by its rollout error, on voyages held out.

    ẋ = f(x, u(t); θ), from the measured first state of a window w                    the model
    L_w(θ) = Σ_t |W r_t|² Δt,  r_t simulated less measured velocities      `simulation.scoring`

    θ̂ = argmin Σ_w ω_w L_w(θ)/σ² + Σ_i ((θ_i - θ₀_i)/(φ s_i))²,  low ≤ θ ≤ high     `output_error`

θ₀ [P] are starting values and s [P] their plausible spreads. With φ = 1 the ridge is the prior
θ ~ N(θ₀, diag(s²)) and θ̂ the most probable θ; φ is its firmness (`regularisation`), ω_w the weight
of a window. The errors of a rollout are correlated over t_c = CORRELATION, so σ² is the variance of
one independent observation of them, three of which a window of T_w has every t_c:

    σ² = t_c Σ_w ω_w L_w/(3 Σ_w ω_w T_w)

The uncertainty is that of a sandwich (Huber 1967, White 1980), in units s: with J_w = ∂r/∂θ,
H = Σ_w ω_w Σ_t J_wᵀ W² J_w Δt/σ² the information of the data and F = I/φ² that of the ridge,

    cov θ̂ = (H + F)⁻¹ (S + F²) (H + F)⁻¹

S is the scatter of the windows' gradients, shrunk towards H (`output_error.covariance`). Settings
are chosen on voyages that no fit has used: those are as good as the best one of which the mean of
paired differences of L_w is within one standard error (Breiman et al. 1984,
`cross_validation.as_good`).
"""
