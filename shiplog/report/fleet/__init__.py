"""Many ships: a list of them, what each diagnosis was made from, one table of verdicts."""
