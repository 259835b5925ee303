"""To other libraries and back: pandas, xarray and Minari; parameter sets of MSS and shipmmg.

The public names stand in `__init__.pyi`; each is imported when it is first used.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
