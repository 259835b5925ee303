"""Signs, frame and origin of a file."""

from dataclasses import dataclass

from shipgym.checks import check_choice, check_number
from shipgym.errors import InputError
from shipgym.trials.installation import AS_LOGGED, Installation


@dataclass(frozen=True)
class Conventions:
    """Signs, frame and origin of a file, and how missing values are treated: as in `Trial.from_csv`.

    With `repair`, holes of more than 10 rows and 20 time steps are refused all the
    same; `where` begins the messages, such as ``"ship.toml: [conventions]"``. Raises
    InputError for another word, and for the origin "cg" without `xg`.
    """

    rudder_positive: str = "starboard"
    velocity_frame: str = "body"
    origin: str = "midship"
    xg: float | None = None
    repair: str | None = None
    where: str = "conventions"
    installation: Installation = AS_LOGGED

    def __post_init__(self) -> None:
        self._check_word("rudder_positive", "starboard", "port")
        self._check_word("velocity_frame", "body", "earth")
        self._check_word("origin", "midship", "cg")
        if self.repair is not None:
            self._check_word("repair", "interpolate")
        if self.xg is not None:
            check_number(self.xg, f"{self.where} xg")
        elif self.origin == "cg":
            raise InputError(
                f"{self.where} origin: expected xg, the distance of the centre of"
                " gravity forward of midship, m, with 'cg', got none; give xg, or"
                ' origin = "midship"'
            )

    def _check_word(self, name: str, *words: str) -> None:
        check_choice(getattr(self, name), words, f"{self.where} {name}")
