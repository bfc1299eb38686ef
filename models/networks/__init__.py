"""Models of networks: their kinds of nodes, layers of links and parameters by name, and their energy. Knows no scene."""
