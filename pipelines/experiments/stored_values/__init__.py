"""Voyages of known motion through every reader, with one thing changed: stored right, or named.

    python -m pipelines.experiments.stored_values --voyages 1000 --jobs 2 --out OUT

A voyage is drawn (ship, motion, instruments, recorder), one unit, sign, frame, clock, order or
value is changed in what its recorder writes, and convert and ingest do the rest. What is stored is
compared with the motion; nothing here is computed with shiplog's own formulas.
"""
