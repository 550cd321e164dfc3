"""The bench: how good and how fast every method is, on the same scans, in one run.

How good is measured on every scan in this process (:mod:`derain.evaluation.scores`), what it
costs in a process of its own for each method (:mod:`.cost`). The two meet in the rows of one table
(:mod:`.rows`).
"""
