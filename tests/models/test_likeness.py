"""Of a state in a checkpoint, a training takes what is like its own."""

import math
from collections import Counter
from typing import Any

import pytest
import torch

from derain.errors import InputError
from derain.files.documents import Entry
from derain.models.callbacks.resumption import matching_state


def taken(found: Any, own: Any) -> Any:
    return matching_state(Entry("last.ckpt", "lr_schedulers", found), own)


def test_what_a_state_lacks_is_left_out() -> None:
    own = {"last_epoch": 0, "_is_initial": False, "milestones": Counter({3: 1})}
    found = {"last_epoch": 2, "milestones": Counter({3: 1, 5: 1}), "step": "replaces a method"}
    assert taken(found, own) == {"last_epoch": 2, "milestones": Counter({3: 1})}


def test_a_number_may_be_infinite_where_it_is_before_the_first_score() -> None:
    assert taken({"best": 0.25}, {"best": math.inf}) == {"best": 0.25}


@pytest.mark.parametrize(
    ("found", "own"),
    [
        ({}, {"base_lrs": []}),
        ({"best": math.nan}, {"best": math.inf}),
        (math.inf, 0.5),
        (-0.5, 0.5),
        (1.5, 1),
        (True, 1),
        (1, True),
        (5, None),
        ([0.5, 0.5], [0.5]),
        (torch.zeros(1).expand(2**40), torch.zeros(1)),
        (torch.zeros(1, dtype=torch.int64), torch.zeros(1)),
        (torch.zeros(1).to_sparse(), torch.zeros(1)),
    ],
    ids=str,
)
def test_what_is_of_another_kind_is_refused(found: Any, own: Any) -> None:
    with pytest.raises(InputError, match=r"last\.ckpt: lr_schedulers"):
        taken(found, own)
