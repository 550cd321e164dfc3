"""Evidence from several scans of a recording: poses of the sensor, and persistence of points.

A method that learns nothing and sees several scans at once is a file of this folder, which enters
it by ``@METHODS.add("its name")`` (:class:`~derain.recordings.recording_method.RecordingMethod`).
"""
