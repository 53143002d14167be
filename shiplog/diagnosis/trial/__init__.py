"""A trial and what its hypotheses share."""
