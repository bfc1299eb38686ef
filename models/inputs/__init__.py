"""Text, numbers and options that a user typed: how they are read and refused. Knows nothing of networks."""
