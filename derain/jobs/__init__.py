"""Work in units: the units of a job, a record of each result, and the processes that do them."""
