"""Manoeuvres as text, JSON and frames, and as pages: the sheet, the pilot card, the poster."""
