"""The slab solver: from a stack of layers to its BSDF."""
