"""From posterior to decision: posterior, refutation by held-out voyages, conventions."""
