"""The options that Lightning's command line takes, as a user writes them."""

from collections.abc import Iterable, Mapping

from jsonargparse import ArgumentParser

# Steps of a key in a file that an option on the command line leaves out.
IMPLIED = ("class_path", "init_args")


def known_options(parser: ArgumentParser, classes: Mapping[str, Iterable[type]]) -> set[str]:
    """Options of a parser, and those of what can be chosen in it, without their dashes.

    Args:
        parser: A subcommand's parser.
        classes: What can be chosen, by the option that chooses it.
    """
    return {
        *_keys(parser),
        *(key for name, chosen in classes.items() for type_ in chosen for key in _of(type_, name)),
    }


def _of(type_: type, name: str) -> set[str]:
    parser = ArgumentParser()
    parser.add_class_arguments(type_, name)
    return _keys(parser)


def _keys(parser: ArgumentParser) -> set[str]:
    # What jsonargparse enters for itself begins with two underscores.
    return {
        ".".join(step for step in key.split(".") if step not in IMPLIED)
        for key in parser.get_defaults().keys()  # noqa: SIM118
        if "__" not in key
    }
