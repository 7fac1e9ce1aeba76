"""Rough surfaces: facet slopes, and what an interface made of facets reflects and transmits."""
