"""The base class of methods of recordings, and their registry."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Self

from derain.sources.method import Method
from derain.system.registry import Registry


class RecordingMethod(Method):
    """A method that learns nothing and sees several scans, made from its parameters.

    It is found by the name that it is registered by, in which there is no dot, for what has a
    suffix is a file::

        @METHODS.add("standing")
        class Standing(RecordingMethod):
            HELP: ClassVar[str] = "rain is what moves"
            ...

    It may judge a frame that was pushed some frames ago. Inside
    :meth:`derain.sources.recent_frames.FrameInWindow.naming_errors`, errors name that frame.

    Attributes:
        HELP: The method's definition of rain, in one line for the help of commands.
    """

    HELP: ClassVar[str] = ""

    @classmethod
    @abstractmethod
    def with_parameters(cls, parameters: Mapping[str, Any], threads: int) -> Self:
        """Makes the method.

        Args:
            parameters: Its parameters by name, as a user gave them; those not given have their
                defaults.
            threads: Threads to use; 0 takes every core this process may use.

        Raises:
            InputError: A parameter that it does not have, or a value that it cannot have:
                :func:`derain.system.registry.from_parameters` raises it for a dataclass.
        """


METHODS: Registry[type[RecordingMethod]] = Registry("derain.recordings", "derain.methods")
