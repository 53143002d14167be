"""Identification of physical models: output error, ridge, cross-validation."""
