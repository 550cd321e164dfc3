"""The formats of scan files, one file each: one that lies here is known by that.

Each adds itself to :data:`derain.files.format.FORMATS`.
"""
