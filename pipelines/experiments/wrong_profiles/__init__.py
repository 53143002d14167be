"""Profiles with one wrong unit, sign or place, on the sample logs: which are seen, and by what."""
