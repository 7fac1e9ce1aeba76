"""The BSDF of the ink alone, for light inside the plate.

Names are imported on first use: tables and the choice of the ink need no JAX.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
