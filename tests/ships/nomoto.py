"""Ships of Nomoto's forms, from the numbers of his transfer functions."""

from shipgym import Particulars, ShipModel, SteeringGear
from shipgym.models.linear import Nomoto


def nomoto1_ship(
    K: float, T: float, particulars: Particulars, steering: SteeringGear | None = None
) -> ShipModel:
    """T rdot + r = K delta; K in 1/s, T in s."""
    coefficients = {"c_r": -1.0 / T, "c_d": K / T}
    gear = steering or SteeringGear()
    return ShipModel("nomoto", "nomoto", particulars, gear, coefficients)


def nomoto2_ship(
    form: Nomoto, particulars: Particulars, steering: SteeringGear | None = None
) -> ShipModel:
    """T1 T2 rddot + (T1 + T2) rdot + r = K (delta + T3 deltadot)."""
    product = form.T1 * form.T2
    coefficients = {
        "c_r": -(form.T1 + form.T2) / product,
        "c_d": form.K * form.T3 / product,
        "e_r": -1.0 / product,
        "e_d": form.K / product,
    }
    gear = steering or SteeringGear()
    return ShipModel("nomoto2", "nomoto2", particulars, gear, coefficients)
