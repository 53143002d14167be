"""What is fast, measured: each module prints its figures with the peer in the same run."""
