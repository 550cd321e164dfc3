"""Networks and the LightningModules that train them: a file, or a folder, for each."""
