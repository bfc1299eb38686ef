"""Files of results of every kind, and what they hold. Knows all kinds of results; runs nothing."""
