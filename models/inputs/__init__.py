"""Text, numbers, expressions and options of users: how they are read, checked and refused. Knows no networks."""
