"""Labels without a human: of a static scene by its geometry, and of any recording by a teacher.

A scene file describes the road and boxes around objects (`scene`). The road's plane is found in the
scans of a sequence, and every point gets its class from its position (`steps`), as REHEARSE-3D was
labelled. A teacher (`teach`) is a method whose answers are labels.
"""
