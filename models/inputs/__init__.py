"""Text, numbers, expressions and options of users: read, checked, refused. No networks."""
