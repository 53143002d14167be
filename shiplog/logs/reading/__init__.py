"""A whole log, read once: its topics as frames, its health."""
