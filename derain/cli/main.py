"""Takes the rain out of LiDAR and fused LiDAR + 4D-radar scans.

  derain run scans/ --out cleaned                       clean scans with derain's own model
  derain run model.onnx scans/ --out cleaned            with another model; or `run dror ...`
  derain view scans/000000.bin --out figure.png         see which points are removed
  derain info default                                   describe derain's own model
  derain bench --data scans/ --methods default dsor     compare error and time
  derain learn drive/ --out model.onnx                  learn from a recording without labels
  derain fit --config outdet_wads.yaml --data.root WADS train on your data
  derain export outdet.ckpt --out model.onnx            make a file that runs without torch
  derain demo                                           all steps on simulated rain

Rain means rain or snow, here and in all output.
"""

import argparse
import io
import os
import signal
import sys
import warnings
from contextlib import suppress
from importlib import import_module
from types import ModuleType

from derain import __version__
from derain.cli.parser import Parser
from derain.cli.signals import interrupting
from derain.errors import InputError, ScanWarning
from derain.system.extras import missing_extra

# What each command does, in order of use. Its module, of the same name, is imported when it is
# chosen; those of TRAINING are Lightning's own, which parses their arguments itself.
SUMMARIES = {
    "run": "clean scans on a CPU, without torch",
    "status": "print the progress of a run over many recordings",
    "view": "look at a scan, or a recording, as several methods clean it",
    "info": "describe a scan, a label file, a model or a data set",
    "bench": "compare methods on labelled scans: error, time and memory",
    "learn": "train a derainer on an unlabelled recording, in about two minutes",
    "tune": "find a method's best parameters on labelled scans",
    "fit": "train a derainer",
    "validate": "measure a checkpoint on the validation scans",
    "test": "measure a checkpoint on the test scans",
    "predict": "write the labels that a checkpoint gives the test scans",
    "export": "make an ONNX file that runs on a CPU without torch",
    "import-weights": "make a checkpoint from published weights",
    "simulate": "make a data set of simulated rain, or add rain to clean scans",
    "annotate": "label the scans of a static scene by its geometry",
    "teach": "label recordings by a method, for a network to learn from",
    "fuse": "merge the frames of a LiDAR and of a 4D radar",
    "odometry": "compute the sensor's pose for each scan",
    "demo": "all steps on simulated rain, in about six minutes",
}

# Exit code if the reader of the output closes the pipe, as of programs that SIGPIPE ends.
BROKEN_PIPE = 128 + 13

TRAINING = ("fit", "validate", "test", "predict")
COMMANDS = tuple(name for name in SUMMARIES if name not in TRAINING)


def main(arguments: list[str] | None = None) -> int:
    """Runs a command.

    Args:
        arguments: Command line without the program's name; by default that of the process.

    Returns:
        Exit code: 0, or 2 where the user's input cannot be used, or BROKEN_PIPE, or 128 and the
        number of the signal that ended it.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed, as by `>&-`: print to nowhere
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # names may hold what is no text
    warnings.simplefilter("ignore", ScanWarning)  # commands print what is odd about scans
    try:
        with interrupting():
            code = _run(arguments)
            sys.stdout.flush()  # here, where a pipe that broke is still ours to handle
            return code
    except InputError as error:
        return _refused(error)
    except ModuleNotFoundError as error:
        if (missing := missing_extra(arguments[0], error)) is None:
            raise
        return _refused(missing)
    except BrokenPipeError as error:
        return _cut_off(error)
    except KeyboardInterrupt as interruption:
        return _interrupted(interruption)
    except (RuntimeError, SystemExit) as error:  # of a class being made, and of Lightning
        if isinstance(error.__context__, KeyboardInterrupt):
            return _interrupted(error.__context__)
        raise
    except OSError as error:
        remedy = "Check the path, its permissions, and the free space on its disk."
        subject = error.filename or "system"
        return _refused(InputError(subject, error.strerror or str(error), remedy))
    except MemoryError:
        return _refused(InputError("memory", "it is full", "Process less at once."))


def _cut_off(error: BrokenPipeError) -> int:
    """Prints what the command had written when the reader of its output closed the pipe."""
    with suppress(BrokenPipeError):  # the same reader may have read the errors
        for note in getattr(error, "__notes__", ()):
            print(f"derain: {note}", file=sys.stderr, flush=True)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except BrokenPipeError:  # Python flushes the rest once more at its end
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    return BROKEN_PIPE


def _interrupted(interruption: KeyboardInterrupt) -> int:
    """Prints which signal ended the command; returns the exit code of that signal."""
    number = getattr(interruption, "signal", signal.SIGINT)
    by = "" if number == signal.SIGINT else f" by {number.name}"
    print(f"derain: interrupted{by}", file=sys.stderr)
    return 128 + number


def _refused(error: InputError) -> int:
    print(f"derain: {error}", file=sys.stderr)
    return 2


def module_of(command: str) -> ModuleType:
    """The module of a command, with its help as docstring, ``add_arguments`` and ``main``.

    Args:
        command: One of COMMANDS.
    """
    return import_module(f"derain.cli.{command.replace('-', '_')}")


def _run(arguments: list[str]) -> int:
    if arguments and arguments[0] in TRAINING:
        from derain.cli.training import train

        return train(arguments)
    command = next((word for word in arguments if word in COMMANDS), None)
    chosen = _parser(command).parse_args(arguments)
    from derain.system.memory import keep_freed_memory  # not needed to print a version or help

    keep_freed_memory()
    return int(module_of(chosen.command).main(chosen))


def _parser(command: str | None) -> Parser:
    """The parser, with the arguments of one command; it only lists the others."""
    as_written = argparse.RawDescriptionHelpFormatter
    parser = Parser("derain", description=__doc__, formatter_class=as_written)
    parser.add_argument("--version", action="version", version=f"derain {__version__}")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, summary in SUMMARIES.items():
        of_command = subparsers.add_parser(name, help=summary, formatter_class=as_written)
        if name == command:
            module = module_of(name)
            of_command.description = module.__doc__
            module.add_arguments(of_command)
    return parser
