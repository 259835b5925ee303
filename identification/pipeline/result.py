"""What `identify` returns: a fit with its summary and files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from identification.judging.fit import Fit
from identification.judging.warnings import (
    error_source,
    findings,
    held_out_error,
    inseparable,
)
from identification.text import as_text, lined_table
from shipgym import InputError, ShipModel
from shipgym.checks import check_choice
from shipgym.drafts import draft_folder
from shipgym.files import write_json
from shipgym.pages.numbers import NONE, fixed, number

PRIME = 1e-5


class CoefficientRow(NamedTuple):
    """A coefficient, as text; derivatives in the prime system times 1e5."""

    name: str
    value: str
    error: str  # standard error
    t: str  # value by its error; a dash without one
    significant: bool  # from two standard errors on


def summary_table(fit: Fit) -> str:
    """Coefficients with standard errors and t, inertia, and the verdict."""
    provenance = fit.model.provenance or {}
    kernel = provenance.get("kernel")
    coefficients = lined_table(
        coefficient_units(fit.model), "name", ">value", ">standard error", ">t"
    )
    for row in coefficient_rows(fit):
        coefficients.add_row(*row[:4])
    ship = lined_table(
        "Ship and steering gear, as in a ship file",
        "name",
        ">value",
        "source",
    )
    for name, source, value in quantities(fit.model):
        ship.add_row(name, value, source)
    shown = [
        f"{fit.model.name}: {how_identified(fit)}; {_verdict(fit)}",
        kernel_text(kernel) if kernel else coefficients,
        ship,
        "The standard errors, on which all intervals rest, come from"
        f" {error_source(provenance)}.",
        *findings(provenance),
        *inseparable(fit),
    ]
    return as_text(*shown)


def result_card(fit: Fit) -> str:
    """The result in a few lines: verdict, held-out error, what next."""
    return (
        f"{fit.model.name}: {how_identified(fit)}; {_verdict(fit)}\n"
        f"{held_out_error(fit)}\n"
        "more: summary(), to_frame(), trials_frame(), model, metrics, save(folder)"
    )


def how_identified(fit: Fit) -> str:
    """Structure, method and samples in words."""
    provenance = fit.model.provenance or {}
    by = f"{provenance.get('structure')} by {provenance.get('method')}"
    return f"{by}, {provenance.get('samples')} samples"


def _verdict(fit: Fit) -> str:
    guard = (fit.model.provenance or {}).get("guard", {})
    unstable = "NOT STABLE: its predictions run away and are not to be used"
    return f"{'stable' if fit.stable else unstable} ({guard.get('decision')})"


def kernel_text(report: Mapping[str, Any]) -> str:
    """Kernel added to the reference ship, in words: its weights tell nothing."""
    return (
        f"Kernel: {report['centres']} radial basis functions of length"
        f" {report['length']:g} in {report['features']} features an equation, C"
        f" {report['C']:g}"
    )


def are_derivatives(model: ShipModel) -> bool:
    """Tell whether coefficients are hydrodynamic derivatives in the prime system."""
    dynamics = model.dynamics
    return dynamics.normalisation == "prime" and dynamics.quantity == "force"


def coefficient_units(model: ShipModel) -> str:
    """What the coefficients are, and their units."""
    if are_derivatives(model):
        return (
            "Hydrodynamic derivatives in the prime system with the instantaneous speed,"
            " times 10⁻⁵"
        )
    dynamics = model.dynamics
    return f"Coefficients of {dynamics.quantity}s, {dynamics.normalisation} units"


def coefficient_rows(fit: Fit) -> list[CoefficientRow]:
    """A row for each coefficient."""
    derivatives = are_derivatives(fit.model)
    rows = []
    for name, error in fit.standard_errors.items():
        value = fit.coefficients[name]
        own, deviation = number(value), number(error)
        if derivatives:
            own, deviation = fixed(value / PRIME, 1), fixed(error / PRIME, 1)
        t, significant = NONE, bool(value)
        if error > 0.0:
            t = fixed(value / error, 1)
            significant = abs(value / error) >= 2.0
        row = CoefficientRow(name, own, deviation, t, significant)
        rows.append(row)
    return rows


def quantities(model: ShipModel) -> list[tuple[str, str, str]]:
    """Particulars and steering gear by their names in a ship file: source and value."""
    ship = model.particulars
    rows = [(name, name in ship.estimated, ship[name]) for name in ship]
    estimated = (model.provenance or {}).get("steering") == "estimated"
    rows += [(name, estimated, one) for name, one in asdict(model.steering).items()]
    sources = {True: "estimated", False: "given"}
    return [
        (name, sources[guess], f"{value:.5g}")
        for name, guess, value in rows
        if isinstance(value, float)
    ]


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
        columns = {
            "value": value,
            "standard_error": error,
        }
        frame = DataFrame(columns, index=names, dtype=float)
        frame["t"] = frame["value"] / frame["standard_error"]
        return frame

    def trials_frame(self) -> DataFrame:
        """Return a row for each trial: its use and the errors of its simulation, SI."""
        from pandas import DataFrame

        rows = {}
        for name, metrics in self.metrics["trials"].items():
            rows[name] = {
                "use": metrics["use"],
                **metrics["rmse"],
            }
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
