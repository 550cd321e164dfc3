"""The formats of scan files, one module each; every module here is registered.

Each adds itself to :data:`derain.files.format.FORMATS`.
"""
