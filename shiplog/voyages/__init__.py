"""A log as a voyage: a 10 Hz table, the store of voyages, 1 Hz rows, windows; its sensors."""
