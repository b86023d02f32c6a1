"""What Cycles evaluates for us: textures, lamps with nodes, worlds.

In scenes of our own that are removed again.
"""
