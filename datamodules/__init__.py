"""LightningDataModules, one file a data set: scans in, views out."""
