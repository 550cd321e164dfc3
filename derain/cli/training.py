"""``derain fit``, ``validate``, ``test`` and ``predict``, which Lightning runs, and their help."""

import shlex

from derain.cli.parser import HELP_ALL
from derain.errors import InputError
from derain.system.extras import TRAINING_LIBRARIES, require
from derain.workflows.configurations import packaged_configs, require_configuration

EXAMPLES = {
    "fit": """\
Trains a derainer. The best and the last checkpoint, the TensorBoard log and the configuration go
to runs/<name>/version_<n>.

  derain fit --config outdet_wads.yaml --data.root WADS
  derain fit --config outdet_wads.yaml --data.root WADS --trainer.logger.name my_run
  derain fit --config outdet_wads.yaml --data.root WADS --ckpt_path .../last.ckpt   (resumes)
  derain fit --config outdet_wads.yaml --data.root WADS --start trained.ckpt   (from its weights)
  tensorboard --logdir runs
""",
    "validate": """\
Measures a checkpoint on the validation scans.

  derain validate --config outdet_wads.yaml --data.root WADS --ckpt_path outdet.ckpt
""",
    "test": """\
Measures a checkpoint on the test scans: scores by average, class and range.

  derain test --config outdet_wads.yaml --data.root WADS --ckpt_path outdet.ckpt
""",
    "predict": """\
Writes the labels that a checkpoint gives the test scans. The scans need no labels.

  derain predict --config outdet_wads.yaml --data.root WADS --ckpt_path outdet.ckpt \\
      --predictions.folder labels
""",
}

# The options that most runs need; `HELP_ALL` lists those that any run can have.
OPTIONS = """\
  --config FILE                     configuration: a YAML file, or the name of a packaged one
  --data.root FOLDER                root folder of the data set
  --ckpt_path FILE                  checkpoint to continue, to measure or to use
  --start MODEL                     start with trained weights: a checkpoint, or default
  --trainer.max_epochs N            passes over the training scans
  --trainer.devices N               devices, or processes on a CPU
  --trainer.accelerator NAME        cpu, gpu, ...
  --trainer.logger.name NAME        name of the run's folder
  --trainer.logger.save_dir FOLDER  folder of the logs (default: runs)
  --data.loading.batch_size N       scans in a batch
  --data.loading.workers N          processes that read scans
  --predictions.folder FOLDER       folder for the labels of `predict`
  --seed_everything N               random seed (default: 0)"""


def _short_help(command: str) -> str:
    """The help of one of the four commands that fits on a screen."""
    networks: dict[str, list[str]] = {}
    for name in packaged_configs():
        networks.setdefault(name.split("_")[0], []).append(name)
    configurations = "\n".join(f"  {'  '.join(of_one)}" for of_one in networks.values())
    return (
        f"usage: derain {command} --config FILE [--OPTION VALUE ...]\n\n{EXAMPLES[command]}\n"
        f"packaged configurations:\n{configurations}\n\noptions:\n{OPTIONS}\n\n"
        "A configuration can set any option, and an option can set any key of a configuration.\n"
        f"All options: derain {command} {HELP_ALL}. "
        "All values, as they would be used: --print_config."
    )


def train(arguments: list[str]) -> int:
    """Runs one of the four commands; after a training, prints how to export its checkpoint.

    Args:
        arguments: The command and its options.

    Returns:
        The exit code, 0.

    Raises:
        InputError: No configuration, or a library of the extra ``train`` is not installed; or as
            for :func:`derain.workflows.training.run_trainer`.
    """
    if {"-h", "--help"} & {*arguments}:
        print(_short_help(arguments[0]))
        return 0
    require_configuration(arguments)
    require(arguments[0], *TRAINING_LIBRARIES)
    from derain.cli.outputs import print_lines
    from derain.workflows.progress import EpochLines
    from derain.workflows.training import checkpoint_of_run, run_trainer

    words = ["--help" if argument == HELP_ALL else argument for argument in arguments]
    callbacks = {"callbacks": [EpochLines()]}
    try:
        trainer = run_trainer(words, EXAMPLES[arguments[0]], callbacks).trainer
    except InputError as error:
        renamed = error.renaming_option("--columns", "--data.loading.columns")
        written = "columns x,y,z,intensity,ring", "columns '[x,y,z,intensity,ring]'"
        renamed = renamed.renaming_option(*written)
        raise renamed.renaming_option("--card", "--data.card") from error
    checkpoint = checkpoint_of_run(trainer)
    if arguments[0] == "fit" and checkpoint is not None and trainer.is_global_zero:
        print_lines(f"Checkpoint: {checkpoint}")
        print_lines(f"derain export {shlex.quote(str(checkpoint))} --out model.onnx")
    return 0
