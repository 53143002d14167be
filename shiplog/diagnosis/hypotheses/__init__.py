"""Causes in combination: evidence, relinearisation, search.

A hypothesis is a set of causes and one kind of remainder. The trial is linearised at the point
where its causes stand. Every number is counted from there, in units of its realistic size:

    r = H θ + ε,   ε ~ N(0, R),   θ ~ N(μ, P)                                            (1)

    r [n]     residual: measured minus simulated
    H [n, N]  sensitivities of the residual
    θ [N]     nominal numbers, then numbers of the causes, then weights of the remainder's family
    R [n, n]  covariance of instrument noise, starts, process noise times λ², deviations of parts
              and voyages

    S = R + H P Hᵀ                                            covariance of v = r - H μ  (2)
    log Z = -½ (vᵀ S⁻¹ v + log|S| + n log 2π)                                  evidence  (3)
    K = P Hᵀ S⁻¹                                                                   gain  (4)
    θ | r ~ N(μ + K v, P - K S Kᵀ)                                            posterior  (5)

n is more than ten thousand and N is about a hundred. The same follows from the products
G = [r H]ᵀ R⁻¹ [r H] of the trial (matrix inversion lemma: Woodbury 1950):

    A = P⁻¹ + Hᵀ R⁻¹ H,   b = P⁻¹ μ + Hᵀ R⁻¹ r                                           (6)
    μ + K v = A⁻¹ b,      P - K S Kᵀ = A⁻¹                                               (7)
    vᵀ S⁻¹ v = rᵀ R⁻¹ r + μᵀ P⁻¹ μ - bᵀ A⁻¹ b                                            (8)
    log|S| = log|R| + log|A| - log|P⁻¹|                                                  (9)

n log 2π is the same for every hypothesis and left out. A trial counts for a share c of itself: its
R⁻¹ and log|R| are c times as large (a power posterior: Grünwald & van Ommen 2017).

Further numbers x ~ N(0, σ² I), with sensitivities X, need no new inverse of A. With θ eliminated,
their normal matrix is a Schur complement:

    M = Xᵀ S⁻¹ X = Xᵀ R⁻¹ X - Bᵀ A⁻¹ B,   B = Hᵀ R⁻¹ X                                  (10)
    y = Xᵀ S⁻¹ v = Xᵀ R⁻¹ r - Bᵀ A⁻¹ b                                                  (11)
    log Z(x) - log Z = ½ yᵀ (M + σ⁻² I)⁻¹ y - ½ log|I + σ² M|                           (12)

The factor λ of the process noise is that of the largest v(λ) = log Z(λ) + log p(λ). It is worked
out at whole powers of a step, λ = 1.08ᵏ. The evidence is the top of the curve through the best of
them and its neighbours, v₋ and v₊, as many observations of a noise have it: x steps away

    v(x) = v + s x + ½ b x² + c (x³ - x)/6,   s = (v₊ - v₋)/2,  b = v₊ - 2v + v₋,  c = -b log 1.08

b counts the observations (-b = 14 for two hours of a three-metre ship), so that the step alone
would cost up to -b/8 nats. While a fit converges two levels give its slope, with the b of the
round before; where it ends there are three. Bounds on the numbers
of a cause add their probability after the data, over that before:

    log P(low ≤ x ≤ high | r) - log P(low ≤ x ≤ high)                                   (13)

Relinearisation moves the point to A⁻¹ b until the step Δ is short (Gauss-Newton):

    δ² = Δᵀ (P - K S Kᵀ)⁻¹ Δ                                            squared length  (14)

The score of a hypothesis is its log posterior up to a constant. Scores give the probabilities:

    score = log Z + log p(causes) + log p(kind) - placebo - form error,
    p(hypothesis | r) = exp(score) / Σ exp(score)                                       (15)
"""
