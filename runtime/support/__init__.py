"""Files, threads, status codes and checks of arrays. Knows no scene."""
