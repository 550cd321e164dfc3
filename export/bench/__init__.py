"""The bench: scores and cost of every method, on the same scans, in one run.

Scores are counted on every scan in this process (:mod:`derain.evaluation.scores`), cost is measured
in a process of its own for each method (:mod:`.cost`). Both are joined in the rows of one table
(:mod:`.rows`).
"""
