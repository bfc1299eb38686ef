"""From a scene to the rows of numbers that a kernel takes, and to the buffers that it fills."""
