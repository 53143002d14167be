"""Sections of a verdict, one a file: what each has as JSON (a frozen dataclass, whose docstring is
its row of docs/reference/answers.md), how it is made of a decision, and its lines of the page."""
