"""The page of an evaluation: how far off models are, against baselines."""
