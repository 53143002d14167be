"""The page of the published experiment: window sets, losses, statements, figures."""
