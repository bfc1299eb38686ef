"""Periodic orbits, their branches and bifurcations: may know stability and runs, no networks."""
