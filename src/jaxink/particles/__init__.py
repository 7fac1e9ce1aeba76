"""Single scattering: phase functions, and the Mie series of a sphere."""
