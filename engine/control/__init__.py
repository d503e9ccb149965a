"""Controller genes and the network that they express.

Read in this order:

- ``genome``: the NEAT genome of a controller.
- ``rates``: how controllers begin and how NEAT mutates them.
- ``operators``: NEAT-Python's operators, which draw, mutate and cross controllers.
- ``neat_092``: operators of the older NEAT-Python that the paper used.
- ``network``: many genomes as networks, evaluated at once on arrays.
- ``simplify``: a network without the neurons that never change.
- ``switch``: two controllers in one, by the side that the target is at.
"""
