"""Figures of fits, diagnoses and ink tables; matplotlib is imported on demand, its global state unchanged."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
