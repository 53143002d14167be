"""What the nominal campaign says of a model before a trial is looked at."""
