"""Names of earlier versions, which checkpoints and configurations may still have."""

from typing import Any

# The names that options have now, by their former names.
FORMER_OPTIONS = {"way_back": "back_projection", "kept_megabytes": "cache_mb"}

FORMER_MONITOR, MONITOR = "val/merit", "val/score"


def with_current_names(checkpoint: dict[str, Any]) -> dict[str, Any]:
    """The same checkpoint, with the current names of the network's options and of the monitor.

    Args:
        checkpoint: The content of a file. It is not trusted.
    """
    options, states = checkpoint.get("hyper_parameters"), checkpoint.get("callbacks")
    if isinstance(options, dict):
        options = {FORMER_OPTIONS.get(name, name): value for name, value in options.items()}
        checkpoint = {**checkpoint, "hyper_parameters": options}
    if isinstance(states, dict):
        states = {current_monitor(key): state for key, state in states.items()}
        checkpoint = {**checkpoint, "callbacks": states}
    return checkpoint


def current_monitor(text: Any) -> Any:
    """The same text, such as the key of a callback's state, with the monitor's current name."""
    return text.replace(FORMER_MONITOR, MONITOR) if isinstance(text, str) else text
