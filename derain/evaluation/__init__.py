"""How good methods are: counts, metrics, baselines, hard cases."""
