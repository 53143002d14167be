"""What shiplog says of measured ships: the figures of docs/evidence."""
