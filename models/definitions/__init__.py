"""Define models by expressions (notebooks, plug-in files) or by tables (scene files); both make the same values."""
