"""Numerical building blocks, independent of optics."""
