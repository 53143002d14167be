"""1 Hz windows for a rollout: which voyages train, which test, augmented how."""
