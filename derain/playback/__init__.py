"""Recordings to look at, scan after scan, in the viewer of Rerun: files ``.rrd``.

:func:`derain.playback.playback.write_playback` writes one. What stands in it, and where, says
:mod:`derain.playback.entities`. Rerun is what ``pip install 'derain[view]'`` installs.
"""
