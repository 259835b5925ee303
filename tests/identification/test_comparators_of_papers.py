"""The extended Kalman filter and the network beside which the papers' cases stand."""

import numpy as np
from papers import comparators, song2020
from papers.zhu2018.fits import first_samples


def test_the_filter_finds_a_linear_equation_and_depends_on_its_start_for_a_cubic_one():
    for structure, small in (("nomoto", True), ("norrbin", False)):
        truth = np.array(list(song2020.TRUTH[structure].values()))
        off = np.abs(comparators.nomoto_history(structure)[-1] / truth - 1.0).max()
        assert (off < 0.01) == small


def test_a_network_steps_the_record_that_it_learned():
    """Heading and yaw rate of a zigzag are predicted to a twentieth of their span."""
    trial = first_samples(song2020.trial("nomoto"), 400)
    found = comparators.trained([trial], ("psi", "r"), 0).run(trial, ("psi", "r"))
    for name, values in found.items():
        assert np.sqrt(np.mean((values - trial[name]) ** 2)) < 0.05 * np.ptp(
            trial[name]
        )
