"""Read and check the user's text, numbers, expressions and options. Independent of networks."""
