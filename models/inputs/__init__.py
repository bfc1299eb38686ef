"""Text, numbers, expressions and options of users: read, checked, refused. Knows no networks."""
