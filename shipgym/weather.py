"""Current, wind and waves under the name that users know; they are made in `shipgym.sea`."""

from shipgym.sea import *  # noqa: F403
