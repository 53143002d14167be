"""Where no cause is known: which force is missing, and what it depends on."""
