"""The verdict as JSON, sentence and page."""
