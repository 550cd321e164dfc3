"""The model that comes with derain: it is trained once, and its threshold is chosen."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import make_default
from benchmarks.make_default import MOST_LOST, MOST_TAKEN, chosen, trained
from derain.errors import InputError

# Stands in for derain: writes the checkpoint that its options name, and fails where broken.txt is.
STAND_IN = """\
while [ "$1" != --trainer.logger.init_args.save_dir ]; do shift; done
mkdir -p "$2/name/version_0/checkpoints"; echo trained > "$2/name/version_0/checkpoints/last.ckpt"
[ ! -e "{broken}" ]
"""

THRESHOLDS = (0.3, 0.4, 0.5, 0.6)


@pytest.fixture
def calls(tmp_path, stand_in_for_derain) -> Path:
    """A file that records how derain was called."""
    return stand_in_for_derain(make_default, STAND_IN.format(broken=tmp_path / "broken.txt"))


def test_a_training_that_ended_is_not_begun_again(calls, tmp_path) -> None:
    training = tmp_path / "seed_7" / "training"
    checkpoint = trained(tmp_path, training, 7)
    called = calls.read_text()
    assert "fit --config cues_worlds.yaml --seed_everything 7" in called
    assert checkpoint.read_text() == "trained\n"
    assert trained(tmp_path, training, 7) == checkpoint
    assert calls.read_text() == called


def test_a_training_that_did_not_end_is_begun_anew(calls, tmp_path) -> None:
    training = tmp_path / "training"
    (tmp_path / "broken.txt").touch()
    with pytest.raises(InputError, match="derain fit failed"):
        trained(tmp_path, training, 7)
    (left,) = training.rglob("last.ckpt")  # it failed, or was stopped, after an epoch
    left.write_text("half\n")
    (tmp_path / "broken.txt").unlink()
    assert trained(tmp_path, training, 7).read_text() == "trained\n"
    assert len(calls.read_text().splitlines()) == 2


shares = st.floats(0, 4 * MOST_TAKEN)
ious = st.floats(0.5, 0.5 + 3 * MOST_LOST)


def by_threshold(values: st.SearchStrategy[float]) -> st.SearchStrategy[dict[float, float]]:
    return st.fixed_dictionaries(dict.fromkeys(THRESHOLDS, values))


@given(by_threshold(ious), st.dictionaries(st.sampled_from("abc"), by_threshold(shares)))
def test_a_threshold_is_raised_as_far_as_clean_scans_ask_and_it_may(iou, taken) -> None:
    best, threshold = chosen(iou, {}), chosen(iou, taken)
    assert iou[best] == max(iou.values())
    assert threshold >= best
    assert iou[threshold] >= iou[best] - MOST_LOST
    bearable = {t for t in THRESHOLDS if all(of[t] <= MOST_TAKEN for of in taken.values())}
    affordable = {t for t in THRESHOLDS if t >= best and iou[t] >= iou[best] - MOST_LOST}
    if threshold in bearable:
        assert not any(t < threshold for t in bearable & affordable)
    else:  # none would do: as little as may be is taken
        assert not bearable & affordable
        assert threshold == max(affordable)
