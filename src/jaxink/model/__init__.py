"""Predicted BSDF of a sample at the points of a measurement."""
