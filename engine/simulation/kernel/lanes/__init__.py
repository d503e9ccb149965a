"""Vectors whose lanes hold simulations, as Numba compiles them. No physics.

Read in this order:

- ``simd``: a vector of doubles or integers as a Numba type, and its operations.
- ``vectors``: arrays of such vectors.
- ``bare``: arrays as bare addresses inside compiled code.
- ``algebra``: three-dimensional algebra on lanes.
- ``transcendental``: exponential, logarithm, sine, cosine and angle with the same bits everywhere.
- ``compiling``: how functions are compiled, and where the result is kept.
- ``kept``: compiled code on disk, loaded only if it is whole.
"""
