"""A log to one 10 Hz table at midship, with a mark on every row."""
