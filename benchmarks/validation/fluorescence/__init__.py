"""Fluorescent inks, simulated by our own Monte Carlo and diagnosed."""
