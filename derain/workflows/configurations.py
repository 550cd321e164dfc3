"""The configurations that come with derain, and how a command line names one."""

import re
from collections.abc import Sequence
from pathlib import Path

from derain.errors import InputError
from derain.files.documents import Entry, packaged

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
        InputError: A name that is neither a file nor packaged, or a file that is no mapping.
    """
    words: list[str] = []
    for argument in arguments:
        if words and words[-1] in CONFIG_OPTIONS:
            argument = str(_file(argument))
        elif argument.startswith("--config="):
            argument = f"--config={_file(argument.removeprefix('--config='))}"
        words.append(argument)
    return words


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


def _file(name: str) -> Path:
    configs = packaged_configs()
    if Path(name).is_file():
        Entry.of_yaml(Path(name)).members()  # the parser would not name the file at fault
        return Path(name)
    if name in configs:
        return configs[name]
    raise InputError(name, "no such configuration", f"Packaged are {', '.join(configs)}.")
