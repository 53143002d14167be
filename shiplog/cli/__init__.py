"""The commands, a file each: `shiplog COMMAND`. They call `shiplog.commands`, as `import shiplog` does.

What is heavy is imported where it is used, after the arguments were checked: a wrong word is
answered at once.
"""

from shiplog.cli.process import main, run

__all__ = ["main", "run"]
