"""A model next to its ship while it sails: the error now, whether it is one too many, and of what.

    source → causal rows → rollouts that restart → error and band
                        ↘ segments → products G_s → evidence of a change → alarm and suspicion

Rows are those of `ingest`, worked out again from the last minutes of messages; a row is provisional
until every rule that could still change it has heard what it waits for (`causal_rows`). The error
is shown by short rollouts (`error_now`). The alarm does not look at that error, whose size depends
on the manoeuvre, but at the likelihood of a diagnosis: of each finished segment

    e_s = J_s d + Z_s z_s + ε_s,   G_s = [e | J]ᵀ C_s⁻¹ [e | J]                  `segment_products`

with the process noise of the nominal campaign in C_s, so that errors which last are no surprise.
`change_evidence` compares a change of one cause that began at segment k with none, for every k and
every cause of a short bank, and adds up (Shiryaev 1963, Roberts 1966; e-detectors: Shin, Ramdas &
Rinaldo 2023). `alarm` holds that sum against the threshold that the user's rate of false alarms
asks for.
"""
