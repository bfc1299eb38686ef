"""The language of claims about spectra and their verdicts. Nothing but the command line uses it."""
