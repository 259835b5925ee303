"""Options of `identify` on the command line: common ones by name, others by `--set`."""

from typing import Annotated, Any

from typer import Option

from agents.cli.parameters import with_options

Source = Annotated[
    str | None,
    Option(help="Source of the covariance: analytic or posterior."),
]
Settings = Annotated[
    list[str] | None,
    Option(
        "--set",
        metavar="OPTION=VALUE",
        help="Any option of the table [identify], or stage.option; repeatable.",
    ),
]


def identify_options(
    structure: Annotated[
        str | None,
        Option(help="Terms of the model; default: the ship file's, else auto."),
    ] = None,
    reference_model: Annotated[
        str | None,
        Option(help="Reference ship of a grey box or of mmg: auto, a name or a file."),
    ] = None,
    hold_out: Annotated[
        list[str] | None,
        Option(
            metavar="FILE",
            help="Trial, by file name, that is only predicted; repeatable.",
        ),
    ] = None,
    current: Annotated[
        str | None,
        Option(help="Current over ground: auto, none or { north, east } in m/s."),
    ] = None,
    wind: Annotated[
        str | None,
        Option(help="Logged wind: auto, none, coefficients or a table."),
    ] = None,
    preprocessing: Annotated[
        str | None,
        Option(help="Smoothing of noisy channels: spline or none."),
    ] = None,
    method: Annotated[
        str | None,
        Option(help="How coefficients are fitted; default: the file's, else tls-svm."),
    ] = None,
    kernel: Annotated[
        str | None, Option(help="Kernel for the residual of the reference ship: rbf.")
    ] = None,
    prior: Annotated[
        str | None,
        Option(help="Prior of structure mmg: a reference ship, auto or yoshimura."),
    ] = None,
    prior_strength: Annotated[
        float | None,
        Option(help="Strength of that prior; default: by trials held out."),
    ] = None,
    uncertainty: Source = None,
    set_: Settings = None,
) -> dict[str, Any]:
    """Options given on the command line, by name; a flag goes before `--set`."""
    from shipgym.files import named_values, toml_value

    by_flag: dict[str, Any] = {
        "structure": structure,
        "reference_model": reference_model,
        "hold_out": hold_out or None,
        "current": current,
        "wind": wind,
        "preprocessing": preprocessing,
        "method": method,
        "kernel": kernel,
        "prior": prior,
        "prior_strength": prior_strength,
        "uncertainty": uncertainty,
    }
    found = named_values(set_ or (), "--set", "seed=3")
    for name, value in by_flag.items():
        if isinstance(value, str) and value.lstrip().startswith("{"):
            value = toml_value(value)
        if value is not None:
            found[name] = value
    return found


#: Gives a command these options, as its argument `options`.
with_identify_options = with_options(identify_options, "options")
