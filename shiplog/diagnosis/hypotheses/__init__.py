"""Causes in combination: evidence, relinearisation, search."""
