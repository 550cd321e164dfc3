"""Methods of recordings by name: those of this folder, and those that other packages bring."""

from typing import TYPE_CHECKING

from derain.system.registry import Registry

if TYPE_CHECKING:
    from derain.recordings.recording_method import RecordingMethod

METHODS: "Registry[type[RecordingMethod]]" = Registry("derain.recordings", "derain.methods")
