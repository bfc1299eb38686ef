"""One step of an integrator for given equations, written as text. Knows neither the driver nor the disk."""
