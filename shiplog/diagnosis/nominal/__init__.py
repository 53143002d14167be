"""What the nominal campaign says of a model before a trial is looked at.

Numbers x [C], in units: the model's coefficients, the causes' nominal numbers and the weights of
the discrepancy. Voyage v has parts i of some minutes, each with numbers of its own (nested random
effects: Laird & Ware 1982), and products G_i of blocks g₀₀, g_i and M_i (`noise`):

    x_vi = x + c_v + b_vi,   b_vi ~ N(0, D),  c_v ~ N(0, a² D)                       the model
    x ~ N(K⁻¹ η, K⁻¹)                                          the prior of a model's numbers

K is diagonal, of spreads that are plausible before any data; η holds the coefficients to the run's
own values where they have moved (`nominal_fit.anchored`). With b integrated out, a part's products
are (`voyage_effects.reduced`; the same with a² D for c, `campaign_prior.reduce_voyages`)

    G ← G - G_•1 D^½ (I + D^½ M D^½)⁻¹ D^½ G_1•,   of volume log|I + D^½ M D^½|.

A trial is further voyages of the ship: its c and b are integrated out of its products likewise. Of
what it has in common with the campaign, which counts for a share κ of itself (a power prior:
Ibrahim & Chen 2000; Grünwald & van Ommen 2017), the prior is the campaign's posterior

    x ~ N(m, V + δ²),   V = (K + κ Σ_v M_v)⁻¹,  m = V (η + κ Σ_v g_v)        `campaign_prior.prior`

with δ = 0, and a D^½ where the campaign is one voyage, whose parts then count as voyages: they
share its c. The products are about the point at which the campaign is linearised. Estimated in this
order:

    θ*, σ, q      Gauss-Newton on the campaign's log density, the noise in each round `nominal_fit`
    D, s, τ       expectation-maximisation; a grid for τ            `campaign_characteristics`
    a, κ          predict each voyage best from the others:  max Σ_v log p(e_v | others; a, κ)
                                                                           `campaign_prior.learn`

`placebo` measures what a cause gains on a nominal voyage, on which nothing has changed.
"""
