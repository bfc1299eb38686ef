"""Models of networks: kinds of nodes, layers of links, names of parameters, and the energy. Imports no scene."""
