"""One self-contained page of a result: no script, no font and no picture from elsewhere."""
