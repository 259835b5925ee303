"""Options of a kernel on what a reference ship leaves of the accelerations."""

from dataclasses import dataclass

from shipgym.checks import bounded, check_choice, check_whole, keep_numbers


@dataclass(frozen=True)
class KernelResidual:
    """Fixed-size LS-SVM with a kernel on what a reference ship leaves.

    The reference ship is that of `grey-box`, or the fitted model of a named structure.

    Parameters
    ----------
    kernel : {"rbf"}
        Radial basis functions on a few centres; they fade outside their data.
    centres : int, from 2 to 100
        Number of these functions.
    length : float or None, above 0
        Width of these functions, relative to the root mean square of the data. None
        chooses it by held-out trials.
    C : float or None, above 0
        Weight of the squared errors over a ship length, prime system. None chooses it
        by held-out trials.
    """

    kernel: str = "rbf"
    centres: int = 64
    length: float | None = bounded(None, above=0.0)
    C: float | None = bounded(None, above=0.0)

    def __post_init__(self) -> None:
        from shipgym.ships.kernel_boxes import RBF, SIZES  # most runs have no kernel

        check_choice(self.kernel, (RBF,), "kernel")
        check_whole(self.centres, "centres", at_least=2, at_most=SIZES[-1])
        keep_numbers(self)
