"""The configurations that come with derain, and how a command line names one."""

import re
from collections.abc import Sequence
from pathlib import Path

from derain.errors import InputError
from derain.files.packaged import packaged

CONFIG_OPTIONS = ("--config", "-c")

# With one of these a run needs no configuration, or there is no run. --data.help and its kin show
# the options of a class.
_INSTEAD = re.compile(r"--(model|print_config|help-all|[\w.]+\.help\b)")


def packaged_configs() -> dict[str, Path]:
    """Files of the configurations that come with derain, by file name."""
    return {file.name: file for file in packaged("derain.configs").values()}


def with_packaged_configs(arguments: Sequence[str]) -> list[str]:
    """Replaces the name of a packaged configuration by its file.

    Raises:
        InputError: A name that is neither a file nor packaged.
    """
    return [
        prefix + str(_file(name)) if name else prefix for prefix, name in _with_names(arguments)
    ]


def own_configurations(arguments: Sequence[str]) -> list[Path]:
    """The configurations on a command line that do not come with derain.

    Raises:
        InputError: A name that is neither a file nor packaged.
    """
    files = [_file(name) for _, name in _with_names(arguments) if name]
    return [file for file in files if file not in packaged_configs().values()]


def require_configuration(arguments: Sequence[str]) -> None:
    """Refuses a subcommand of Lightning's without a configuration.

    Raises:
        InputError: None is given.
    """
    if not any(a.startswith(CONFIG_OPTIONS) or _INSTEAD.match(a) for a in arguments):
        raise InputError(
            arguments[0],
            "no configuration is given",
            f"Give --config with a file or a packaged one: {', '.join(packaged_configs())}.",
        )


def _with_names(arguments: Sequence[str]) -> list[tuple[str, str]]:
    """Every argument as what stands before the name of a configuration, and the name, if any."""
    return [
        ("--config=", argument.removeprefix("--config="))
        if argument.startswith("--config=")
        else ("", argument)
        if previous in CONFIG_OPTIONS
        else (argument, "")
        for previous, argument in zip(["", *arguments], arguments, strict=False)
    ]


def _file(name: str) -> Path:
    configs = packaged_configs()
    if Path(name).is_file():
        return Path(name)
    if name in configs:
        return configs[name]
    raise InputError(name, "no such configuration", f"Packaged are {', '.join(configs)}.")
