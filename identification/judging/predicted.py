"""Channels of a trial that a model's equations predict."""

from shipgym import ShipModel

COMPARED = ("u", "v", "r", "psi")


def predicted_channels(model: ShipModel) -> tuple[str, ...]:
    """Channels of `COMPARED` that a model's equations predict.

    A velocity without an equation keeps its first value, so its error says nothing
    about the coefficients. The heading is the integral of the yaw rate.
    """
    equations = set(getattr(model.dynamics, "equations", "uvr"))
    if "r" in equations:
        equations.add("psi")
    return tuple(name for name in COMPARED if name in equations)


def predicts_track(model: ShipModel) -> bool:
    """Return True if speed and drift are predicted, as a track needs."""
    return {"u", "v"}.issubset(predicted_channels(model))


def is_yaw_alone(model: ShipModel) -> bool:
    """Return True where nothing but yaw rate and heading is predicted."""
    return predicted_channels(model) == ("r", "psi")
