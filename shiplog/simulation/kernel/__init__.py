"""Machine code made of a model's own equations: rollouts, derivatives, segments.

    acceleration -> jaxpr -> graph -> derivatives -> lowered -> functions -> loops -> code
                    from_jaxpr  graph  derivatives   elementary  functions  windows,  machine_code
                                                                            segments

f = ν̇(θ, x, u) of one sample is a graph of scalars. Its derivatives ∂f/∂x, ∂f/∂u and ∂f/∂θ are taken
in reverse on that graph and share what they have in common with f. What depends on θ alone is
computed once a call. Loops run f for as many windows or segments at a time as a vector has lanes,
and do with value and derivatives what is to be done, step by step, while they are in the cache:

    rollouts        xₖ₊₁, ∂xₖ₊₁/∂θ, and Σ JᵀJ, Jᵀe of windows by Euler's method
    paths           means over bins and their derivatives, by two-step Adams-Bashforth
    given_slopes    the same of slopes that JAX has worked out
    bordered_roots  Cholesky roots of many small matrices at once, of no model

`kinds` keeps a kernel for each kind of ship. Where none can be made, the callers ask JAX.
"""
