"""Files, threads, progress, status codes and checks of arrays. Knows no scene."""
