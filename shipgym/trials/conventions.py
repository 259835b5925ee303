"""Signs, frame and origin of a file."""

from dataclasses import dataclass

from shipgym.checks import check_choice, check_number
from shipgym.errors import InputError
from shipgym.trials.installation import AS_LOGGED, Installation

_WORDS = {
    "rudder_positive": ("starboard", "port"),
    "velocity_frame": ("body", "earth"),
    "origin": ("midship", "cg"),
    "repair": ("interpolate",),
}


@dataclass(frozen=True)
class Conventions:
    """Signs, frame and origin of a file, and the treatment of missing values.

    The fields are the arguments of `Trial.from_csv`. With `repair`, holes of more than
    10 rows and 20 time steps are refused all the same; `where` begins the messages,
    such as ``"ship.toml: [conventions]"``. Raises InputError for another word, and for
    the origin "cg" without `xg`.
    """

    rudder_positive: str = "starboard"
    velocity_frame: str = "body"
    origin: str = "midship"
    xg: float | None = None
    repair: str | None = None
    where: str = "conventions"
    installation: Installation = AS_LOGGED

    def __post_init__(self) -> None:
        for name, known in _WORDS.items():
            word = getattr(self, name)
            if word is not None or name != "repair":
                check_choice(word, known, f"{self.where} {name}")
        if self.xg is not None:
            check_number(self.xg, f"{self.where} xg")
        elif self.origin == "cg":
            raise InputError(
                f"{self.where} origin: expected xg, the distance of the centre of"
                " gravity forward of midship, m, with 'cg', got none; give xg, or"
                ' origin = "midship"'
            )
