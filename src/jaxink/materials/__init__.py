"""Refractive indices of materials as functions of the wavelength; no JAX is needed for them."""
