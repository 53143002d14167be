"""Options of a training, the configuration of a run, its files."""
