"""Limits of the user against today's results: the file, the figures, what holds, JUnit."""
