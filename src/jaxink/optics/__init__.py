"""Directions, channels, refractive indices, smooth interfaces and the optics of a layer."""
