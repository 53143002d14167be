"""The folder that holds voyages as tables, and its catalogue."""
