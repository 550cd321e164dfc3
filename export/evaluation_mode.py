"""A model as it is exported: on the CPU and in evaluation mode."""

from collections.abc import Iterator
from contextlib import contextmanager

from derain.models.base import DerainingModule


@contextmanager
def evaluation_on_cpu(model: DerainingModule) -> Iterator[None]:
    """Moves a model to the CPU in evaluation mode; afterwards its device and modes are restored.

    Args:
        model: The model, which is changed in place.
    """
    device = model.device
    training = [module for module in model.modules() if module.training]
    try:
        model.eval().cpu()
        yield
    finally:
        model.to(device)
        for module in training:
            module.training = True
