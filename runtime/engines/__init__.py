"""Who runs rows: the integrator of a scene, its kernel, and the job that runs blocks of cells."""
