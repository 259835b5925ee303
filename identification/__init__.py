"""Identification of manoeuvring models from recorded trials.

The public names stand in `__init__.pyi` and are imported on first use: scikit-learn
takes a second.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
