"""The page of voyages' health: what `ingest` found."""
