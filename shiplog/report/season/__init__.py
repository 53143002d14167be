"""A season: text, JSON, page and picture."""
