"""Ships to be steered by software: trials, models, manoeuvres and environments.

Importing shipgym registers its environments with Gymnasium. The public names are in
`__init__.pyi`; each is imported when it is first used.
"""

from shipgym.envs.registration import register_environments
from shipgym.extras import public_names

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = public_names(__name__, __file__)

register_environments()
