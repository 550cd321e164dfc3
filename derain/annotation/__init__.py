"""Labels the scans of a static scene by its geometry, as REHEARSE-3D was labelled.

A scene file (`scene`) says where things stand. The road's plane (`plane`) is found in the scans of
a sequence, and every point gets its class from where it lies (`steps`).
"""
