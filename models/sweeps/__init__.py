"""The numbers of cells: parameters, initial states, axes, and what is drawn along an axis of realisations. Knows no scene."""
