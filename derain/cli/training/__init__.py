"""The four commands that are Lightning's: fit, validate, test and predict."""
