"""LightningModules and their networks, one file a model."""
