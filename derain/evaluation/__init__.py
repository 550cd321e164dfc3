"""Counts, metrics, baselines and hard cases, by which methods are measured."""
