"""Where no cause is known: which force is missing, and what it depends on.

The residual acceleration at the nodes is a | e ~ N(â, V) (`noise.residual_acceleration`).

    F̂ = M â [3],  |F̂| > F_own + k sd(F̂) + allowed      no force of the ship: it acts from outside
                                                                             `external_forces`
    R² = 1 - Σ (y - ŷ)²/Σ (y - ŷ₀)²                     of y = â on voyages left out, ŷ by ridge
        regressions with an omitted input and ŷ₀ without it                   `omitted_inputs`

M [3, 3] is the matrix of masses and added masses, F_own what screws, rudders, wind and hull could
add. What would separate two causes a and b is simulated in advance (`next_manoeuvre`): of products
G of a manoeuvre, with the prior information Λ on all numbers,

    A = κ G - κ G (κ G + Λ)⁻¹ κ G,   nats = ½ (pᵀ A_aa p - pᵀ A_ab (A_bb + I)⁻¹ A_ba p)
"""
