"""A trial and what its hypotheses share.

The trial is linearised, segment by segment, where a hypothesis stands (`Trial.linearise`):

    r_s = J_s θ + Z_s z_s + ε_s,   z_s ~ N(0, Q(λ)),   ε_s ~ N(0, R_s)                    (1)

    r_s [n]      residual of segment s: measured minus simulated, in bins
    J_s [n, C]   sensitivities to the numbers θ [C], each in units of its realistic size
    Z_s [n, Z]   sensitivities to z_s [Z]: the start, and process noise at the nodes
    Q(λ) [Z, Z]  covariance of z_s; the standard deviation of the process noise is λ times nominal

Start and process noise are integrated out. A weight w_s makes a few segments count less:

    S_s = R_s + Z_s Q Z_sᵀ                                       covariance [n, n]        (2)
    G_k = Σ_{s in k} w_s [r J]_sᵀ S_s⁻¹ [r J]_s                  part k: [1 + C, 1 + C]   (3)

Part k of voyage v has the numbers θ + c_v + b_k, b_k ~ N(0, D), c_v ~ N(0, a² D) (nested random
effects: Laird & Ware 1982). Both are integrated out of the products, part by part, then voyage by
voyage, by a Schur complement with M the block of G that belongs to J:

    G - G[:, J] D^½ (I + D^½ M D^½)⁻¹ D^½ G[J, :]                                         (4)
    log|R| = Σ_s w_s log|S_s| + Σ log|I + D^½ M D^½|                                      (5)

The sum over voyages is G = [r H]ᵀ R⁻¹ [r H] of the room `hypotheses`, with log|R| as its volume.
"""
