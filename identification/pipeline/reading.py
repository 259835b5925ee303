"""Options of `identify` read from tables of names and values.

Such tables are a ship file's [identify] and the options of the command line. An option
has the name of an argument of `identify`, such as `structure`, or that of a setting of
a stage, such as `samples.window`; the stage may be left out (`window`). A setting that
several stages have belongs to the method where its name stands alone.
"""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from identification.models.methods import METHODS, make_method, method_options
from identification.models.refinement import Refinement
from identification.pipeline.options import DEFAULT_METHOD, MAP, STAGES, Options
from shipgym import InputError
from shipgym.checks import check_choice, check_table, did_you_mean

#: The setting of each stage that its name alone stands for.
WORDS = {name: fields(kind)[0].name for name, kind in STAGES.items()}
WORDS["method"] = "name"
#: Arguments of `identify` that are no stage, and come from such a table.
ARGUMENTS = tuple(
    item.name
    for item in fields(Options)
    if item.name not in (*WORDS, "particulars", "steering")
)


def stage_settings() -> dict[str, list[str]]:
    """Names of the settings of each stage but for the one that its name stands for."""
    found = {
        stage: [item.name for item in fields(kind)][1:]
        for stage, kind in STAGES.items()
    }
    of_methods = [option for method in METHODS for option in method_options(method)]
    found["method"] = list(dict.fromkeys(of_methods))
    return found


def option_names() -> dict[str, str]:
    """Full names of options by every name that they may be given."""
    found: dict[str, str] = {}
    for stage, settings in stage_settings().items():  # the method comes last
        found |= {setting: f"{stage}.{setting}" for setting in settings}
        found |= {f"{stage}.{setting}": f"{stage}.{setting}" for setting in settings}
        found[f"{stage}.{WORDS[stage]}"] = stage
    return found | {name: name for name in (*ARGUMENTS, *WORDS)}


def read_table(table: Any, where: str) -> dict[str, Any]:
    """Values of a table of options by their full names.

    Parameters
    ----------
    table : mapping
        Values by name; a stage may be a table of its settings.
    where : str
        Begins messages, such as ``"ship.toml: [identify]"``.

    Raises
    ------
    InputError
        For an unknown option.
    """
    known = option_names()
    found: dict[str, Any] = {}
    for name, value in check_table(
        table,
        where,
    ).items():
        own = {name: value}
        if name in WORDS and isinstance(value, Mapping):
            own = {f"{name}.{setting}": one for setting, one in value.items()}
        for option, one in own.items():
            if option not in known:
                alone = ", ".join(name for name in known if "." not in name)
                raise InputError(
                    f"{where} {option}: expected an option of identify, got an unknown"
                    f" one.{did_you_mean(option, known) or f' There are {alone}.'}"
                )
            found[known[option]] = one
    return found


def identify_arguments(values: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of `identify` from options by their full names.

    Raises InputError for values that they cannot have, and for options that do not
    belong together.
    """
    arguments = {name: values[name] for name in ARGUMENTS if name in values}
    for stage, kind in STAGES.items():
        settings = _settings_of(values, stage)
        if stage == "kernel" and settings and "kernel" not in values:
            raise InputError(
                f"{', '.join(settings)}: expected a kernel that this is a setting of,"
                ' got none; give kernel = "rbf"'
            )
        if stage in values:
            settings[WORDS[stage]] = values[stage]
        if settings:
            arguments[stage] = kind(**settings)

    if "method" in values:
        arguments["method"] = check_choice(
            values["method"],
            (*METHODS, MAP),
            "method",
        )
    settings = _settings_of(values, "method")
    if settings:
        made = make_method(arguments.get("method", DEFAULT_METHOD), settings)
        (made.start if isinstance(made, Refinement) else made).check()
        arguments["method"] = made
    Options(**arguments)
    return arguments


def _settings_of(values: Mapping[str, Any], stage: str) -> dict[str, Any]:
    """The settings of a stage among options by their full names."""
    prefix = f"{stage}."
    return {
        name.removeprefix(prefix): value
        for name, value in values.items()
        if name.startswith(prefix)
    }
