"""Equilibria of networks, periodic orbits, their branches and bifurcations: may know stability and runs."""
