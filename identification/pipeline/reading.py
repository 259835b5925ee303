"""Options of `identify` read from tables of names and values.

Such tables are a ship file's [identify] and the options of the command line.

An option has the name of an argument of `identify`, such as `structure`, or that of a
setting of a stage, such as `samples.window`. The stage may be left out (`window`), or
be written with an underscore (`prior_strength`). Of a setting that several stages have,
`C` and `folds`, the name alone is the kernel's where there is one, else the method's.
"""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from identification.models.methods import METHODS, make_method, method_options
from identification.models.refinement import Refinement
from identification.pipeline.options import DEFAULT_METHOD, MAP, STAGES, Options
from shipgym import InputError
from shipgym.checks import check_choice, check_table, check_text, did_you_mean, placed

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
    found = {}
    for stage, kind in STAGES.items():
        names = [item.name for item in fields(kind)]
        found[stage] = names[1:]

    of_methods = list[str]()
    for method in METHODS:
        for option in method_options(method):
            if option not in of_methods:
                of_methods.append(option)
    found["method"] = of_methods
    return found


def read_table(
    table: Any, where: str, with_kernel: bool | None = None
) -> dict[str, Any]:
    """Values of a table of options by their full names, each checked.

    Parameters
    ----------
    table : mapping
        Values by name; a stage may be a table of its settings.
    where : str
        Begins messages, such as ``"ship.toml: [identify]"``.
    with_kernel : bool, optional
        Whether the identification has a kernel; by default whether the table says so.

    Raises
    ------
    InputError
        For an unknown option, or a value that it cannot have.
    """
    options = _flattened(check_table(table, where))
    if with_kernel is None:
        with_kernel = "kernel" in options
    found: dict[str, Any] = {}
    for name, value in options.items():
        full = full_name(name, where, with_kernel)
        with placed(where):
            check_value(full, value, options.get("method"))
        found[full] = value
    return found


def _flattened(table: Mapping[str, Any]) -> dict[str, Any]:
    """The table with the settings of its stages beside its other options."""
    options = {}
    for name, value in table.items():
        if name not in WORDS or not isinstance(value, Mapping):
            options[name] = value
            continue
        for setting, own in value.items():
            is_word = setting == WORDS[name]
            option = name if is_word else f"{name}.{setting}"
            options[option] = own
    return options


def full_name(name: str, where: str, with_kernel: bool = False) -> str:
    """Full name of an option; InputError for one that does not exist.

    The message begins with `where`.
    """
    known = option_names(with_kernel)
    if name in known:
        return known[name]
    hint = did_you_mean(name, known)
    raise InputError(
        f"{where} {name}: expected an option of identify, got an unknown one.{hint}"
    )


def option_names(with_kernel: bool) -> dict[str, str]:
    """Full names of options by every name that they may be given.

    Of a setting that several stages have the name alone is that of the last: the method
    or, with one, the kernel.
    """
    known = stage_settings()
    last = "kernel" if with_kernel else "method"
    alone, found = dict[str, str](), dict[str, str]()
    for stage in sorted(known, key=lambda stage: stage == last):
        found[f"{stage}.{WORDS[stage]}"] = stage
        for setting in known[stage]:
            full = f"{stage}.{setting}"
            found |= {full: full, f"{stage}_{setting}": full}
            alone[setting] = full
    return alone | found | {name: name for name in (*ARGUMENTS, *WORDS)}


def check_value(name: str, value: Any, method: Any = None) -> None:
    """Refuse a value that an option, by its full name, cannot have with any method.

    The message is that of the `method` named.
    """
    # Settings that are lists of names.
    if name == "hold_out":
        _check_names(value, name.rpartition(".")[2])
        return

    stage, _, setting = name.partition(".")
    if name == "method":
        check_choice(value, (*METHODS, MAP), "method")
    elif name in ARGUMENTS:
        Options(**{name: value})
    elif stage == "method":
        _check_setting(setting, value, method)
    else:
        STAGES[stage](**{setting or WORDS[stage]: value})


def _check_setting(setting: str, value: Any, method: Any) -> None:
    """Refuse a value of a setting that no method can have.

    The message is that of the method named.
    """
    refusals = []
    for name in sorted(METHODS, key=lambda name: name != method):
        if setting not in method_options(name):
            continue
        try:
            checked_method(name, {setting: value})
        except InputError as error:
            refusals.append(error)
        else:
            return
    raise refusals[0]


def _check_names(value: Any, where: str) -> None:
    if not isinstance(value, list):
        raise InputError(f"{where}: expected a list of names of trials, got {value!r}")
    for name in value:
        check_text(name, where)


def checked_method(name: str, settings: Mapping[str, Any]) -> Any:
    """The estimator or refinement of a name, its settings checked."""
    made = make_method(name, settings)
    estimator = made.start if isinstance(made, Refinement) else made
    estimator.check()
    return made


def identify_arguments(values: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of `identify` from options by their full names.

    Raises InputError for options that do not belong together.
    """
    arguments = {name: values[name] for name in ARGUMENTS if name in values}
    for stage, kind in STAGES.items():
        settings = settings_of(values, stage)
        if stage == "kernel" and settings and "kernel" not in values:
            names = ", ".join(settings)
            raise InputError(
                f"{names}: expected a kernel that this is a setting of,"
                ' got none; give kernel = "rbf"'
            )
        if stage in values:
            word = WORDS[stage]
            settings[word] = values[stage]
        if settings:
            arguments[stage] = kind(**settings)

    method = values.get("method", DEFAULT_METHOD)
    settings = settings_of(values, "method")
    if settings:
        arguments["method"] = checked_method(method, settings)
    elif "method" in values:
        arguments["method"] = method
    return arguments


def settings_of(values: Mapping[str, Any], stage: str) -> dict[str, Any]:
    """The settings of a stage among options by their full names."""
    settings = {}
    for name, value in values.items():
        owner, _, setting = name.partition(".")
        if owner == stage and setting:
            settings[setting] = value
    return settings
