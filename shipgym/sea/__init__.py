"""Weather: what current, wind and waves do to a ship.

What a user gives is in `conditions`; what becomes of it for one ship in `wind`,
`gusts`, `waves`, `motions`, `drift` and `weather_column`. The public names are in
`__init__.pyi`.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
