"""Draft a ship profile for a log or a table that nobody has described yet.

A draft is a proposal: what was guessed from a name says CHECK, what was not found says so, and
each line has a comment on what the data hold.
"""

from shiplog.drafting.tables import draft_table
from shiplog.drafting.topics import draft

__all__ = ["draft", "draft_table"]
