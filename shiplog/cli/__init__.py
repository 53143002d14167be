"""The commands, a file each: `shiplog COMMAND`. Like `import shiplog` they call `shiplog.commands`.

What is heavy is imported where it is used, after the arguments were checked: a wrong word is
answered at once.
"""

from shiplog.cli.process import main, run

__all__ = ["main", "run"]
