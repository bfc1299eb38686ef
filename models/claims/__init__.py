"""The language of claims about spectra, and verdicts on claims. Only the command line uses this folder."""
