"""The page of several results next to each other: what is alike, what changed and by how much."""
