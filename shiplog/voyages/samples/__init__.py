"""Each source's samples in SI: status, marks of no value, plausible values, orders."""
