"""Likelihood of the residuals: process noise, its factors, effects of campaigns.

    e_s = J_s d + Zₐ Φ_s w + Z_s z_s + ε_s,   Z_s = (Z₀ | Zₐ),  z_s = (δξ_s, a_s)       the model

    ε_s ~ N(0, R)     of channel c: σ_c² ((1 - ρ_c) I + ρ_c exp(-|tᵢ - tₖ|/τ_c))      `Whitening`
    δξ_s ~ N(0, P₀)   the start, P₀ = diag(σ₀²)
    a_s ~ N(0, λ² Q)  process noise, Q = diag(q²) ⊗ exp(-|tᵢ - tⱼ|/τ): in each channel an
                      Ornstein-Uhlenbeck process at the nodes; of a force at one place in addition
                      p pᵀ ⊗ (on ∘ exp(-|tᵢ - tⱼ|/τ_p))                  `ProcessNoise.kernel`
    w ~ N(0, s² I)    weights of a family of the model's discrepancy                `discrepancy`

With z_s integrated out, all that numbers x = (d, w) need are the products of each segment, of
E = [e | J] where J has the columns Zₐ Φ_s behind those of J_s:

    G_s(λ) = Eᵀ C_s⁻¹ E,   C_s = R + Z₀ P₀ Z₀ᵀ + λ² Zₐ Q Zₐᵀ                         the likelihood
    -2 log p(e | x, λ) = Σ_s ((1, -x) G_s (1, -x)ᵀ + log|C_s|) + constant

Three eliminations give G_s, each exact:

    1  instruments   E ← R^-½ E,  Z ← R^-½ Z, and their products              `likelihood.weighed`
    2  start         C₀ = R + Z₀ P₀ Z₀ᵀ,  F = Z₀ᵀ Z₀,  of X = (E | Zₐ)
                     Xᵀ C₀⁻¹ X = Xᵀ X - Xᵀ Z₀ (F + P₀⁻¹)⁻¹ Z₀ᵀ X           `likelihood.start_of`
    3  nodes         A = Zₐᵀ C₀⁻¹ Zₐ + (λ² Q)⁻¹ = L Lᵀ,  G(λ) = Eᵀ C₀⁻¹ E - (L⁻¹ B)ᵀ (L⁻¹ B),
                     B = Zₐᵀ C₀⁻¹ E, for any shape of Q             `part_products.PartPass.gram`

The volume is that of a restricted likelihood (Patterson & Thompson 1971): the start is fitted, and
how far a model lets it be felt is no evidence,

    log|C| := log|R| + log|F + P₀⁻¹| - log|F| + log|λ² Q| + log|A|.

Numbers with the prior N(Λ⁻¹ η, Λ⁻¹), in units, are then integrated out (the evidence) or estimated
(the posterior), G = Σ_s w_s G_s with blocks g₀₀, g = G₁₀ and M = G₁₁:

    x | e ~ N((M + Λ)⁻¹ (g + η), (M + Λ)⁻¹)
    log p(e) = -½ (g₀₀ + ηᵀ Λ⁻¹ η - (g + η)ᵀ (M + Λ)⁻¹ (g + η) + log|M + Λ| - log|Λ|)
               - ½ Σ log|C_s| + constant                                `campaign_parts.marginal`

σ, q, ρ, τ are estimated from the nominal campaign (`noise_estimate`); a trial's process noise is
λ times the nominal one, or raised in each channel by itself (`raised_noise`, `remainder`).
"""
