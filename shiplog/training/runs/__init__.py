"""The folder that a training leaves, and how it is opened again."""
