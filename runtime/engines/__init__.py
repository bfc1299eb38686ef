"""Run rows of cells: choose the integrator of a scene, load its kernel, and make the job that runs blocks of cells."""
