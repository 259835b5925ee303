"""Choices by which the covariance of the coefficients is found."""

from dataclasses import dataclass

from shipgym.checks import check_choice, check_flag, check_whole


@dataclass(frozen=True)
class Uncertainty:
    """Where the covariance of the coefficients comes from.

    Parameters
    ----------
    covariance : {"analytic", "posterior"}
        From the residuals, taken as correlated between the equations and over the time
        to sail one ship length; or from a posterior by sampling, whose draws the model
        keeps.
    model_error : bool
        Whether the covariance is scaled until trials left out in turn are predicted
        within it; a posterior always is.
    steps : int, from 20
        Steps of the walkers that sample a posterior, after half as many to warm up.
    """

    covariance: str = "analytic"
    model_error: bool = True
    steps: int = 130

    def __post_init__(self) -> None:
        kinds = ("analytic", "posterior")
        check_choice(self.covariance, kinds, "uncertainty")
        check_flag(self.model_error, "model_error")
        check_whole(self.steps, "uncertainty.steps", at_least=20)

    @property
    def by_sampling(self) -> bool:
        """Whether it is a posterior by sampling."""
        return self.covariance == "posterior"
