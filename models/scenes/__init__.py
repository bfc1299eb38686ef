"""What is simulated: a model with its numbers, start, records and axes, and the files that hold it."""
