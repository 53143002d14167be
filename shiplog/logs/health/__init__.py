"""What is lost or damaged in a log, as findings."""
