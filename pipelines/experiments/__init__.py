"""What is measured about shiplog itself. It is not installed with the program."""

import os

# As the commands have it: the same numbers on every number of cores (`shiplog.cli.process`).
os.environ.setdefault("NPROC", "1")
