"""Evaluation by Cycles: textures, lamps with nodes, worlds.

In scenes of our own that are removed again.
"""
