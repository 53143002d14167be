"""The published experiment: window sets, what it states of them, its figures (Wakita et al., 2024,
J. Mar. Sci. Technol., doi:10.1007/s00773-024-01036-w)."""
