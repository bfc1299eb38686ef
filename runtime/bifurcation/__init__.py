"""Find equilibria of networks, periodic orbits, branches and bifurcations. Modules here use stability and runs."""
