"""The sweep trains variants alike, each once, and goes on where it was stopped."""

import shlex
from pathlib import Path

import pytest

from benchmarks import ingredients
from benchmarks.ingredients import Sweep, Variant

PLAN = """\
seed: 4
epochs: 2
thresholds: [0.25, 0.5]
common: --config outdet_simulated.yaml --data.make false
data:
  streets: simulate --layout street
  other: simulate --layout facility
variants:
  range alone: --data.root {streets} --model.channels [range]
  "another network, for short": {fit: "--config mine.yaml --data.root {other}", thresholds: []}
  broken: --broken --data.root {streets}
"""

# Stands in for derain: writes what its options name, and refuses --broken.
STAND_IN = """\
case "$*" in *--broken*) exit 2;; esac
while [ $# -gt 0 ]; do
  if [ "$1" = --out ]; then mkdir -p "$(dirname "$2")"; echo made > "$2"; fi
  shift
done
"""


@pytest.fixture
def calls(stand_in_for_derain) -> Path:
    """A file that records how derain was called."""
    return stand_in_for_derain(ingredients, STAND_IN)


@pytest.fixture
def asked(tmp_path) -> Sweep:
    (tmp_path / "plan.yaml").write_text(PLAN)
    return Sweep.of_yaml(tmp_path / "plan.yaml", tmp_path / "models")


def test_variants_are_trained_alike_on_the_data_that_they_name(asked) -> None:
    alone, network, _ = asked.variants
    made, fit, export = asked.commands(alone)
    folder = asked.folder / "range_alone"
    assert shlex.join(made) == f"simulate --layout street --out {asked.folder}/data-sets/streets"
    assert shlex.join(fit).startswith(
        "fit --config outdet_simulated.yaml --seed_everything 4 --trainer.max_epochs 2 "
        f"--data.make false --data.root {asked.folder}/data-sets/streets "
        "--model.channels '[range]' "
    )
    assert export == ["export", str(folder / "model.ckpt"), "--out", str(folder / "model.onnx")]
    made, fit, _ = asked.commands(network)
    assert "facility" in made
    assert fit[:5] == ["fit", "--config", "mine.yaml", "--seed_everything", "4"]
    assert "outdet_simulated.yaml" not in fit


@pytest.mark.parametrize("titles", [("a b", "a, b"), ("?", "a")])
def test_no_variant_takes_the_folder_of_another(titles, tmp_path) -> None:
    lines = [f'  "{title}": --config mine.yaml' for title in titles]
    text = "\n".join(["seed: 0", "epochs: 1", "variants:", *lines])
    (tmp_path / "plan.yaml").write_text(text)
    with pytest.raises(ValueError, match="have to differ"):
        Sweep.of_yaml(tmp_path / "plan.yaml", tmp_path)


def test_a_row_for_each_threshold(asked) -> None:
    alone, network, _ = asked.variants
    assert dict(alone.rows()) == {
        "range alone, at 0.25": {"threshold": 0.25},
        "range alone, at 0.5": {"threshold": 0.5},
    }
    assert dict(network.rows()) == {network.title: {}}
    assert network.folder == "another_network_for_short"


def test_a_model_that_is_there_is_not_trained_again(asked, calls) -> None:
    alone = asked.variants[0]
    assert asked.train(alone) is None
    first = calls.read_text()
    assert [line.split()[0] for line in first.splitlines()] == ["simulate", "fit", "export"]
    assert asked.train(alone) is None
    assert calls.read_text() == first


def test_a_variant_that_changed_or_was_stopped_is_trained_anew(asked, calls) -> None:
    alone = asked.variants[0]
    asked.train(alone)
    asked.train(Variant(alone.title, alone.fit.replace("range", "z")))
    assert len(calls.read_text().splitlines()) == 6
    asked.model(alone).with_name("commands.txt").unlink()
    asked.train(alone)
    assert len(calls.read_text().splitlines()) == 9


def test_a_variant_that_fails_names_its_log(asked, calls) -> None:
    broken = asked.variants[2]
    reason = asked.train(broken)
    assert "derain fit failed" in reason
    assert not asked.model(broken).exists()
    assert (asked.folder / "broken/log.txt").exists()
