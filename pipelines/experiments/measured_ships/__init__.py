"""Every data set at hand, from its files to a verdict, as its owner would go."""
