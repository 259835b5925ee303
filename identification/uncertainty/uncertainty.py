"""Choices by which the covariance of the coefficients is found."""

from dataclasses import dataclass

from shipgym.checks import check_choice, check_flag


@dataclass(frozen=True)
class Uncertainty:
    """Where the covariance of the coefficients comes from.

    Parameters
    ----------
    covariance : {"analytic", "bootstrap"}
        From the residuals, taken as correlated between the equations and over the time
        to sail one ship length; or from refits to blocks of that length drawn with
        replacement.
    model_error : bool
        Whether the covariance is scaled until trials left out in turn are predicted
        within it.
    """

    covariance: str = "analytic"
    model_error: bool = True

    def __post_init__(self) -> None:
        check_choice(self.covariance, ("analytic", "bootstrap"), "uncertainty")
        check_flag(self.model_error, "model_error")
