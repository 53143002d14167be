"""Training of feedforward networks: gradient, kernel, queue of seeds, GPU, cluster."""
