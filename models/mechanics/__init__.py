"""Derive the equations of one node from energies, forces, friction and units. Imports no graph."""
