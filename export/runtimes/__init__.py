"""Runtimes of exported networks, one module each, by name.

A file of this folder enters by ``@RUNTIMES.add("its name")``, and needs to be named nowhere else:
:class:`.session.Session` describes what it brings with it. None imports its library before a model
is opened with it, so that nobody has to install or load more than the one that they use.
"""
