"""One thing, one name: over the whole package no name stands for two things."""

import ast
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
FOLDERS = ("derain", "models", "datamodules", "export", "configs")

# What every module of a kind has under one name, for whoever looks for it there.
SUMMARY_OF_A_COMMAND = {"SUMMARY", "DESCRIPTION"}
KEYS_OF_A_NETWORK = {"PUBLISHED_KEYS"}
OF_EVERY_MODULE = {"__all__", "_PARSERS", *SUMMARY_OF_A_COMMAND, *KEYS_OF_A_NETWORK}

# Still to be renamed; a name that is no longer used twice is taken off its list.
CLASSES_LEFT = {"ResidualBlock", "ViewedScan"}
CONSTANTS_LEFT = {
    *("CHANNELS", "EXAMPLES", "LARGEST", "LAYOUTS", "MOST_COLUMNS", "MOST_NEIGHBOURS"),
    *("OPTIONS", "STEPS", "TYPES", "WARM_UP"),
}
GENERATORS_LEFT = {
    *("derain/cli/tune.py", "derain/evaluation/hard_cases.py"),
    "export/onnx_file.py",
}

MAKES_A_GENERATOR = re.compile(r"np\.random\.default_rng\(|generator_of\(")
NAME_OF_A_GENERATOR = re.compile(r"(.+_)?generator")


@cache
def modules() -> dict[str, ast.Module]:
    """Every module of the package by its path in the repository."""
    files = sorted(file for folder in FOLDERS for file in (REPOSITORY / folder).rglob("*.py"))
    assert len(files) > 100
    return {
        file.relative_to(REPOSITORY).as_posix(): ast.parse(file.read_text("utf-8"))
        for file in files
    }


def assigned(node: ast.AST) -> Iterator[tuple[str, ast.expr]]:
    """Names that a statement gives to a value, and the value."""
    if isinstance(node, ast.Assign):
        targets = node.targets
    elif isinstance(node, ast.AnnAssign):
        targets = [node.target]
    else:
        return
    for target in targets:
        if isinstance(target, ast.Name) and node.value is not None:
            yield target.id, node.value


def constants(module: ast.Module) -> Iterator[tuple[str, str]]:
    """Names of constants that a module defines, and the source of their values."""
    for statement in module.body:
        for name, value in assigned(statement):
            if name == name.upper() or name.startswith("__"):
                yield name, ast.unparse(value)


def generators(module: ast.Module) -> Iterator[str]:
    """Names that a module gives to random generators: variables, attributes and parameters."""
    for node in ast.walk(module):
        if isinstance(node, ast.arg) and _is_of_a_generator(node):
            yield node.arg
        for name, value in assigned(node):
            if MAKES_A_GENERATOR.match(ast.unparse(value)):
                yield name


def _is_of_a_generator(parameter: ast.arg) -> bool:
    annotation = parameter.annotation
    return annotation is not None and ast.unparse(annotation) == "np.random.Generator"


def twice(named: Iterable[tuple[str, str]]) -> dict[str, set[str]]:
    """What stands under a name, where that is more than one thing."""
    things = defaultdict(set)
    for name, thing in named:
        things[name].add(thing)
    return {name: found for name, found in things.items() if len(found) > 1}


def test_no_two_classes_have_one_name() -> None:
    found = twice(
        (node.name, f"{path}:{node.lineno}")
        for path, module in modules().items()
        for node in ast.walk(module)
        if isinstance(node, ast.ClassDef)
    )
    assert found.keys() == CLASSES_LEFT, found


def test_no_two_constants_of_one_name_have_different_values() -> None:
    found = twice(pair for module in modules().values() for pair in constants(module))
    assert found.keys() - OF_EVERY_MODULE == CONSTANTS_LEFT, found


def test_a_random_generator_is_called_generator() -> None:
    found = [(path, name) for path, module in modules().items() for name in generators(module)]
    others = [(path, name) for path, name in found if not NAME_OF_A_GENERATOR.fullmatch(name)]
    assert len(found) - len(others) > 20
    assert {path for path, _ in others} == GENERATORS_LEFT, others
