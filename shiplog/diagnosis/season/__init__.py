"""A season: how large a cause is from voyage to voyage, and where that leads.

The hypothesis holds the causes in question, fitted to all voyages at once. Of all of them together,
y and M of equation (17), the room `onset`, a stretch a voyage, are the likelihood of sizes of their
own in each of the V voyages, the nominal numbers integrated out:

    log p(r | x) = yᵀ x - ½ xᵀ M x + constant,   x = (x_1 … x_V), each [q]                (21)

Voyages of one season are alike, but not the same. Partial pooling (the hierarchical normal model:
Gelman et al. 2013, Sec. 5.4; Rubin 1981) lets the data say how alike:

    x_v ~ N(μ_g(v) + β t_v, τ² I),   μ_g ~ N(0, s² I),   β ~ N(0, I)                      (22)
    p(τ) ∝ 1/(1 + (τ/A)²)                               half-Cauchy (Gelman 2006)

    g(v)  stretch of the season between two events, such as dockings, that voyage v is in
    t_v   date of the voyage, -½ to ½ over the season; β, of causes that wear, is the change over it
    τ     how far voyages of one level differ, in units of the cause's realistic size

With w = (μ, β, u), u_v = x_v less its mean, x = B w, a τ gives a Gaussian:

    A = Bᵀ M B + P⁻¹,   w | r, τ ~ N(A⁻¹ Bᵀ y, A⁻¹),   P = diag(s², 1, τ²)
    log p(r | τ) = ½ yᵀ B A⁻¹ Bᵀ y - ½ log|A| - ½ log|P|                                  (23)

Each cause has a τ of its own; they are integrated out on a grid, those of several causes by Gibbs
sampling with w integrated out (`pooling`). (21) is linear about what all voyages have in common; a
voyage that is far from it is fitted by itself first (`own_numbers`).

The date at which the trend passes a limit x* is that of μ_G + β t = x*, G the last stretch, over
the draws of w (`limit`).

`speed_loss` is of the log and the model alone: the speed through the water of steady blocks over
that of the model at the same revolutions, in the sense of ISO 19030-2:2016.

References: A. Gelman (2006), Bayesian Analysis 1, 515-533. A. Gelman et al. (2013), Bayesian Data
Analysis, 3rd ed. D. B. Rubin (1981), J. Educational Statistics 6, 377-401.
"""
