"""Files, threads, progress, status codes and checks of arrays. Imports no scene."""
