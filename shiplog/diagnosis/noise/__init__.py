"""Likelihood of the residuals: process noise, its factors, effects of campaigns."""
