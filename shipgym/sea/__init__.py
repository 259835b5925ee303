"""Weather: the effects of current, wind and waves on a ship.

User input is in `conditions`; its effects on one ship are in `wind`, `motions`,
`drift` and `weather_column`. The public names are in `__init__.pyi`.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
