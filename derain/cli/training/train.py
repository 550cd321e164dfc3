"""``derain fit``, ``validate``, ``test`` and ``predict``: training and measuring networks."""

import shlex

from derain.cli.outputs import print_lines
from derain.cli.training.help import ALL, EXAMPLES
from derain.workflows.training import run_trainer


def train(arguments: list[str]) -> None:
    """Runs one of the four commands; after a training, prints how to export its best checkpoint.

    Args:
        arguments: The command and its options.

    Raises:
        InputError: As for :func:`derain.workflows.training.run_trainer`.
    """
    words = ["--help" if argument == ALL else argument for argument in arguments]
    trainer = run_trainer(words, descriptions=EXAMPLES).trainer
    best = getattr(trainer.checkpoint_callback, "best_model_path", "")
    if arguments[0] == "fit" and best and trainer.is_global_zero:
        print_lines(f"Best checkpoint: {best}")
        print_lines(f"derain export {shlex.quote(best)} --out model.onnx")
