"""Identification of manoeuvring models from recorded trials.

The public names stand in `__init__.pyi` and are imported on first use: scikit-learn
takes a second.
"""

from shipgym.extras import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
