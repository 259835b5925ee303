"""Options of `identify` on the command line: common ones by name, others by `--set`."""

from typing import Annotated, Any

from typer import Option

from agents.cli.parameters import with_options

Settings = Annotated[
    list[str] | None,
    Option(
        "--set",
        metavar="OPTION=VALUE",
        help=(
            "Any option of the table [identify], or stage.option, such as"
            " uncertainty=posterior; repeatable."
        ),
    ),
]


def identify_options(
    structure: Annotated[
        str | None,
        Option(help="Terms of the model; default: the ship file's, else auto."),
    ] = None,
    method: Annotated[
        str | None,
        Option(help="How coefficients are fitted; default: the file's, else tls-svm."),
    ] = None,
    set_: Settings = None,
) -> dict[str, Any]:
    """Options given on the command line, by name; a flag goes before `--set`."""
    from shipgym.files import named_values

    found = named_values(set_ or (), "--set", "seed=3")
    for name, value in {"structure": structure, "method": method}.items():
        if value is not None:
            found[name] = value
    return found


#: Gives a command these options, as its argument `options`.
with_identify_options = with_options(identify_options, "options")
