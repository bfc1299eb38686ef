"""Synchronisability of networks from spectra and stable ranges: may know no simulation."""
