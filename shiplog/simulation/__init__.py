"""Rollouts, their derivatives and errors; baselines, coverage, the interval of a prediction."""
