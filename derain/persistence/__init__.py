"""Persistence: what is solid is where it was a moment ago, and a drop is not.

``points.py`` is what is known of a scan by itself, ``rays.py`` what the rays of another scan say
of the places of its points, ``evidence.py`` how both are weighed, ``vote.py`` how points near each
other agree.
"""
