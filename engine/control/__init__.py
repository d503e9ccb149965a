"""Controller genes and the network that they express.

Read in this order:

- ``genome``: the NEAT genome of a controller, drawn and mutated by NEAT-Python's operators.
- ``network``: many genomes as networks, evaluated at once on arrays.
"""
