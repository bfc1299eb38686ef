"""What is simulated: a model with its numbers and what is recorded of it, and the files that hold it."""
