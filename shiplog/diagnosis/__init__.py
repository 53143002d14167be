"""From segments to a verdict: nominal campaign, hypotheses, posterior, refutation."""
