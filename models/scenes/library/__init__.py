"""Scene files that are shipped."""
