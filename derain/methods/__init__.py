"""Methods that learn nothing and see several scans of a recording at once.

A file of this folder enters one by ``@METHODS.add("its name")``, and needs to be named nowhere
else: :class:`~derain.methods.recording_method.RecordingMethod` says what it brings with it.
"""
