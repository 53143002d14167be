"""The page of a verdict: a file a section, a line each in `page.SECTIONS`."""
