"""Bad input of an identification: one clear message, or a result that is marked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from identification import identify, write_report
from identification.judging.warnings import model_warnings, why_unstable
from shipgym import InputError, ShipFile, ShipModel, Trial

DEMO = Path(__file__).parents[2] / "examples" / "mariner"


def changed(trial: Trial, name: str, **channels: np.ndarray[Any, Any]) -> Trial:
    return Trial(trial.t, {**trial.channels, **channels}, name=name, kind=trial.kind)


@pytest.fixture
def refusal(mariner: ShipModel) -> Callable[..., str]:
    """The message with which the Mariner's identification from a trial is refused."""

    def message(trial: Trial, **arguments: Any) -> str:
        with pytest.raises(InputError) as error:
            identify([trial], particulars=mariner.particulars, **arguments)
        return str(error.value)

    return message


def test_an_unknown_option_is_named_with_the_nearest(
    cao_zigzag: Trial, refusal: Callable[..., str]
) -> None:
    assert "Did you mean 'structure'" in refusal(cao_zigzag, strcture="abkowitz")
    told = refusal(cao_zigzag, method="abc-lssvr", objective="best")
    assert told.startswith("objective: expected one of")


def test_a_rudder_that_never_moves_excites_nothing(
    cao_zigzag: Trial, refusal: Callable[..., str]
) -> None:
    told = refusal(changed(cao_zigzag, "still", delta=0.0 * cao_zigzag.t))
    assert (
        "trial 'still': expected a rudder that moves, got one that stays at 0.00"
        in told
    )
    assert "such as a zigzag" in told
    with pytest.raises(InputError, match=r"'degrees': delta: .* likely in degrees"):
        changed(cao_zigzag, "degrees", delta=57.3 * cao_zigzag["delta"])


@pytest.mark.parametrize(
    ("channel", "more"),
    [("u", "; nomoto, norrbin and nomoto2 take the speed of [ship]"), ("v", "")],
)
def test_a_channel_that_is_missing_is_named(
    cao_zigzag: Trial, refusal: Callable[..., str], channel: str, more: str
) -> None:
    kept = {
        name: values for name, values in cao_zigzag.channels.items() if name != channel
    }
    told = refusal(Trial(cao_zigzag.t, kept, name="short"), structure="abkowitz")
    assert told == (
        f"trial 'short': channel '{channel}' is missing, structure 'abkowitz' needs u,"
        " v, r, delta; name its "
        f'column, or leave the trial out (use = "skip"){more}'
    )


@pytest.mark.parametrize(("channel", "structure"), [("v", "abkowitz"), ("r", "nomoto")])
def test_a_motion_that_never_changes_is_named(
    cao_zigzag: Trial, refusal: Callable[..., str], channel: str, structure: str
) -> None:
    told = refusal(
        changed(cao_zigzag, "flat", **{channel: 0.0 * cao_zigzag.t}),
        structure=structure,
    )
    assert f"got a channel '{channel}' that never changes" in told
    assert "choose a structure without that equation" in told


@pytest.mark.parametrize("method", ["ls", "tls-svm"])
def test_of_exactly_collinear_terms_what_was_left_out_is_told(
    cao_zigzag: Trial, mariner: ShipModel, method: str
) -> None:
    tied = changed(cao_zigzag, "tied", v=-20.0 * cao_zigzag["r"])
    fit = identify([tied], "linear-steering", method, particulars=mariner.particulars)
    assert fit.diagnostics["r"].rank == 2
    assert "separate b_v, b_r: their combination was left out" in " ".join(
        fit.summary().split()
    )


@pytest.mark.parametrize("method", ["ls-svm", "ridge", "abc-lssvr", "rls", "tmils"])
def test_a_method_that_leaves_nothing_out_marks_exactly_collinear_terms(
    cao_zigzag: Trial, mariner: ShipModel, method: str
) -> None:
    tied = changed(cao_zigzag, "tied", v=-20.0 * cao_zigzag["r"])
    fit = identify([tied], "linear-steering", method, particulars=mariner.particulars)
    marked = "yaw: the data cannot separate c_v, c_r: exactly collinear"
    assert marked in " ".join(fit.summary().split())
    assert any(text.startswith(marked) for text in model_warnings(fit))
    assert np.all(np.isfinite(list(fit.coefficients.values())))


def test_fewer_samples_than_terms(
    cao_zigzag: Trial, refusal: Callable[..., str]
) -> None:
    few = Trial(
        cao_zigzag.t[:12],
        {c: v[:12] for c, v in cao_zigzag.channels.items()},
        name="short",
    )
    told = refusal(few)
    assert "the 15 coefficients of an equation, got 12, in all 11 rows" in told


def test_arguments_of_another_kind_are_named(
    cao_zigzag: Trial, mariner: ShipModel
) -> None:
    for trials, found in (
        (cao_zigzag, "Trial"),
        ("a.csv", "'a.csv'"),
        ([cao_zigzag, 3], "3"),
    ):
        with pytest.raises(InputError, match=rf"trials: .*a list of Trials.*{found}"):
            identify(trials, particulars=mariner.particulars)  # type: ignore[arg-type]


def test_trials_of_a_model_at_another_scale(
    cao_zigzag: Trial, refusal: Callable[..., str]
) -> None:
    """The Mariner at a scale of 1 to 100 in Froude's time."""
    speed = {c: 0.1 * cao_zigzag[c] for c in ("u", "v")}
    channels = {**cao_zigzag.channels, **speed, "r": 10.0 * cao_zigzag["r"]}
    told = refusal(Trial(0.1 * cao_zigzag.t, channels, name="tank"))
    assert "trial 'tank': expected a speed of 1.544 to 15.44 m/s" in told
    assert "likely the trial of another ship or scale" in told


def test_trials_of_a_ship_of_another_speed(
    cao_zigzag: Trial, refusal: Callable[..., str]
) -> None:
    fast = changed(cao_zigzag, "frigate", u=3.0 * cao_zigzag["u"])
    assert (
        "expected a speed of 1.544 to 15.44 m/s for a service speed of 7.7175 m/s"
        in refusal(fast)
    )


def test_an_unstable_model_is_kept_and_marked_and_no_environment_takes_it(
    mariner: ShipModel, tmp_path: Path
) -> None:
    """A turning circle cannot separate 40 coefficients; least squares has no guard."""
    ship = ShipFile.load(DEMO / "ship.toml")
    trials = [
        t.with_(use="fit" if "turning" in t.name else "validate") for t in ship.trials()
    ]
    result = identify(
        trials, method="ls", particulars=ship.particulars, steering=ship.steering
    )
    assert not result.stable
    assert "runs away" in (why_unstable(result) or "")
    assert "NOT STABLE" in result.summary()
    result.save(tmp_path / "ship")
    write_report(result, tmp_path / "ship")
    page = (tmp_path / "ship" / "report.html").read_text(encoding="utf-8")
    assert "The identified model is unstable" in page
    kept = ShipModel.load(tmp_path / "ship" / "model.json")
    assert kept.coefficients == result.coefficients
    assert (kept.provenance or {})["stable"] is False
    path = str(tmp_path / "ship" / "model.json")
    with pytest.raises(
        InputError, match=r"found unstable when it was identified.*allow_unstable=True"
    ):
        gymnasium.make("shipgym/CourseKeeping-v0", model=path)
    with pytest.warns(UserWarning, match="found unstable when it was identified"):
        gymnasium.make("shipgym/CourseKeeping-v0", model=path, allow_unstable=True)
