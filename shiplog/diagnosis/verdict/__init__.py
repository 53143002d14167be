"""What the hypotheses say together, and what held-out voyages leave of it.

A hypothesis h holds causes, each with numbers of its own, and one kind of remainder. Its score is
its log evidence and log prior (`hypotheses`); of those that are not banned

    p(h | data) = exp(score_h)/Σ exp(score)                                      `posterior`
    p(cause | data) = Σ_h p(h | data) P(|its numbers| are of practical size | h, data)
    p(none | data) = Σ_{h nominal} p(h | data) Π_causes (1 - P(practical | h, data))

The second factor is the share of draws x̂ + V^½ t of the cause's numbers. A cause is named where
p(cause) ≥ STATED; else a kind of remainder is, or nothing, or the verdict is undecided (`decide`).
Held-out windows then refute it (`refutation`): with L_w the loss of window w, by numbers fitted
without its voyage, the gain 1 - Σ L_with/Σ L_without has a 90 % interval; a cause whose interval
lies below zero is banned, and the posterior is that of the hypotheses that are left.
"""
