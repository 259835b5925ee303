"""What `identify` returns: a fit with its summary and files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from identification.judging.fit import Fit
from identification.pipeline.summary import result_card, summary_table
from shipgym import InputError
from shipgym.checks import check_choice
from shipgym.drafts import draft_folder
from shipgym.files import write_json

if TYPE_CHECKING:
    from pandas import DataFrame

#: Files of a saved result; the last one is that of `write_report`.
FILES = ("model.json", "metrics.json", "settings.json", "report.html")


class IdentificationResult(Fit):
    """An identified model and how it came about; `Fit` lists its attributes."""

    def summary(self) -> str:
        """Table of all coefficients and of the inertia they are based on.

        Name, value and standard error (of forces in the prime system 1e-5) and t;
        inertia that was not given is marked as estimated.
        """
        return summary_table(self)

    def __repr__(self) -> str:
        """Return a card of a few lines: the verdict, errors and coefficients."""
        return result_card(self)

    def _repr_html_(self) -> str:
        """Return the card and a table of the coefficients, for a notebook."""
        table: str = self.to_frame().to_html(float_format="%.4g")
        return f"<pre>{escape(result_card(self))}</pre>{table}"

    def to_frame(self) -> DataFrame:
        """Return a row for each coefficient: value, standard error and t."""
        from pandas import DataFrame

        value = list(self.coefficients.values())
        names = list(self.coefficients)
        error = [self.standard_errors.get(name) for name in names]
        columns = {"value": value, "standard_error": error}
        frame = DataFrame(columns, index=names, dtype=float)
        frame["t"] = frame["value"] / frame["standard_error"]
        return frame

    def trials_frame(self) -> DataFrame:
        """Return a row for each trial: its use and the errors of its simulation, SI."""
        from pandas import DataFrame

        rows = {}
        for name, metrics in self.metrics["trials"].items():
            rows[name] = {"use": metrics["use"], **metrics["rmse"]}
        return DataFrame.from_dict(
            rows,
            orient="index",
        )

    def plot(self, channel: str = "psi", trial: str = "", ax: Any = None) -> Any:
        """Draw a trial as measured and as predicted on axes of matplotlib.

        Returns the axes. Raises InputError for an unknown trial or channel.

        Parameters
        ----------
        channel : str
            As in `Trial.plot`.
        trial : str, optional
            Its name; by default the first that was held out, else the first.
        ax : matplotlib.axes.Axes, optional
            By default the current ones.
        """
        known = {one.name: one for one in self.trials}
        first, *_ = sorted(self.trials, key=lambda one: one.use == "fit")
        shown = known[check_choice(trial or first.name, known, "trial")]
        ax = shown.plot(channel, ax, label="measured", color="#1f2a37")
        predicted = self.predictions.get(shown.name)
        if predicted is not None:
            predicted.plot(channel, ax, label="predicted", color="#1d70b8")
        ax.legend(title=shown.name)
        return ax

    def save(self, folder: str | Path) -> None:
        """Write model.json, metrics.json and settings.json, all or none.

        The same call on the same data gives the same files, byte for byte.

        Raises InputError where it cannot be written.

        Parameters
        ----------
        folder : str or Path
            Created where it does not exist; an earlier report.html in it goes.
        """
        folder = Path(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with draft_folder(folder / "identification") as draft:
                self._write(draft)
                for name in FILES:
                    if (draft / name).exists():
                        (draft / name).replace(folder / name)
                    else:  # an earlier one would describe another model
                        (folder / name).unlink(missing_ok=True)
        except OSError as error:
            raise InputError(
                f"{folder}: expected a folder that can be written, got"
                f" {error.strerror!r}; choose another folder"
            ) from error

    def _write(self, folder: Path) -> None:
        self.model.save(folder / "model.json")
        write_json(self.metrics, folder / "metrics.json")
        write_json(self.settings, folder / "settings.json")


def with_provenance(
    result: IdentificationResult, further: Mapping[str, Any]
) -> IdentificationResult:
    """The result with more in the provenance of its model."""
    provenance = {**(result.model.provenance or {}), **further}
    return replace(
        result,
        model=replace(result.model, provenance=provenance),
    )
