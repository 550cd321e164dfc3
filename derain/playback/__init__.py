"""Recordings for Rerun's viewer: files ``.rrd`` that show scan after scan.

:func:`derain.playback.playback.write_playback` writes one; :mod:`derain.playback.entities` lists
its entities. It needs Rerun: ``pip install 'derain[view]'``.
"""
