"""Training of networks: the gradient of a rollout, recipes, queues."""
