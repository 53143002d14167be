"""Since when a named cause acts: its beginning and end, marginalised over change points.

Runs after the verdict and changes nothing of it. The trial is linearised where the verdict's
hypothesis stands. Process noise and the other causes are conditioned on: their factor and their
presence stay, their numbers are free. A cause with numbers x [q], in units of its realistic size,
acts on the stretches b of the trial where the indicator o_b is one:

    r_b = H_b θ + o_b h_b x + ε_b,   θ ~ N(μ, P),   x ~ N(0, I)                          (16)

    r_b      residual of stretch b (one segment or a few) where the cause is absent
    H_b θ    nominal numbers with the deviations of parts and voyages, and the other causes
    h_b [q]  sensitivities to the cause's numbers; zero where it is off

With θ and the noise integrated out, S = R + H P Hᵀ, all that is needed of the data is

    y_b = h_bᵀ S⁻¹ (r - H μ) [q],   M_bc = h_bᵀ S⁻¹ h_c [q, q]      `stretch_information`    (17)

Both are Schur complements of each segment's G_s, as (4), (10) and (11). A cause that begins with
stretch i and ends before stretch j then has, with sums over i <= b, c < j,

    y = Σ y_b,   M = ΣΣ M_bc,   log B(i, j) = ½ yᵀ (M + I)⁻¹ y - ½ log|M + I|             (18)

which is (12) with σ = 1. Running sums of y and M give each pair (i, j) in the same time, so that
all change points cost one pass. With prior p(i, j) the beginning has the probability

    p(i | r) = Σ_j p(i, j) B(i, j) / Σ_ij p(i, j) B(i, j)               `change_points`      (19)

(a retrospective change point of known number: Smith 1975; Bayesian model averaging over it:
Barry & Hartigan 1993). i = 0 is "present from the start".

A cause that grows has a slope instead (`drift`): x = x₀ + x₁ τ_b, τ the date of the stretch, with

    y = Σ (1, τ_b) ⊗ y_b,   M = ΣΣ (1, τ_b)(1, τ_c)ᵀ ⊗ M_bc.                               (20)

References: A. F. M. Smith (1975), Biometrika 62, 407-416. D. Barry & J. A. Hartigan (1993), JASA
88, 309-319.
"""
