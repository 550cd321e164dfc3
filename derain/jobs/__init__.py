"""Work in units: what is to be done, a record of what is done, and the processes that do it."""
