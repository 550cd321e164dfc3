"""States in checkpoints, which are not trusted, reduced to what a run has itself."""

import math
from collections.abc import Mapping
from typing import Any

from torch import Tensor

from derain.errors import InputError
from derain.files.documents import Entry, shown
from derain.models.limits import LARGEST_COMPUTABLE

# Of epochs, batches and steps: more than any training takes, and a number that a float holds.
LARGEST_COUNT = 2**53

REMEDY = "Give a checkpoint of the same network, as derain wrote it."


def matching_state(found: Entry, own: Any) -> Any:
    """A state from a checkpoint, reduced to the entries of the run's own state.

    Lightning and torch enter whatever a checkpoint holds into their own objects.

    Args:
        found: The state in the checkpoint. It is not trusted.
        own: The state of the same object before it is restored.

    Returns:
        The found value, without keys that the own state lacks. Names that begin with an underscore
        may be missing, for they differ between versions of torch.

    Raises:
        InputError: Keys missing, lists of another length, tensors of another shape, or values of
            another kind; a number that is negative or not finite where the own number is neither.
    """
    value = found.value
    if isinstance(own, Mapping) and isinstance(value, Mapping):
        return _like_mapping(found, own)
    if isinstance(own, list | tuple) and isinstance(value, list | tuple) and len(own) == len(value):
        parts = [matching_state(_part(found, key), part) for key, part in enumerate(own)]
        return tuple(parts) if isinstance(value, tuple) else parts
    if isinstance(own, Tensor) and isinstance(value, Tensor):
        _refuse_another_tensor(found, own)
    elif isinstance(own, int | float) and not isinstance(own, bool):
        _refuse_another_number(found, own)
    elif type(own) is not type(value) or isinstance(own, list | tuple):
        raise found.fault(f"{shown(value)} does not fit this training", REMEDY)
    return value


def _like_mapping(found: Entry, own: Mapping[Any, Any]) -> Any:
    public = {key for key in own if isinstance(key, str) and not key.startswith("_")}
    if missing := public - found.value.keys():
        raise found.fault(f"{min(missing)} is missing", REMEDY)
    taken = {key: matching_state(_part(found, key), own[key]) for key in found.value if key in own}
    return type(own)(taken)  # type: ignore[call-arg]  # a dict or a Counter


def _part(whole: Entry, key: Any) -> Entry:
    return Entry(whole.source, f"{whole.key}.{key}", whole.value[key])


def _refuse_another_tensor(found: Entry, own: Tensor) -> None:
    value = found.value
    fits = value.shape == own.shape and value.is_floating_point() == own.is_floating_point()
    if not fits or value.layout != own.layout:
        raise found.fault(f"a tensor of shape {tuple(value.shape)} does not fit", REMEDY)
    if own.isfinite().all() and not value.isfinite().all():
        raise found.fault("holds numbers that are not finite", REMEDY)


def _refuse_another_number(found: Entry, own: float) -> None:
    if not math.isfinite(own):  # such as the best score before there is one
        if type(found.value) not in (int, float) or math.isnan(found.value):
            raise found.fault(f"{shown(found.value)} is not a number", REMEDY)
        return
    try:
        number = found.number()
    except InputError as error:
        raise found.fault(error.reason, REMEDY) from error
    if isinstance(own, int) and not isinstance(found.value, int):
        raise found.fault(f"{number:g} is not a whole number", REMEDY)
    if number < 0 <= own:
        raise found.fault(f"{number:g} is negative", REMEDY)
    if abs(number) > (LARGEST_COUNT if isinstance(own, int) else LARGEST_COMPUTABLE):
        raise found.fault(f"{number:g} is too large", REMEDY)
