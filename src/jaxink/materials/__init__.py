"""Complex refractive indices of pigments, fillers and binders, from open tables with their sources."""

from jaxink.materials.named import Material, listing, material, names

__all__ = ["Material", "listing", "material", "names"]
