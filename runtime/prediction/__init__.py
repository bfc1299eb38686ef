"""Synchronisability of networks from spectra and stable ranges. Imports no simulation."""
