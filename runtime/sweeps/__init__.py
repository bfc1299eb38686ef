"""Run the cells of a scene in blocks on workers, in memory or to disk, and certify synchronous cells."""
