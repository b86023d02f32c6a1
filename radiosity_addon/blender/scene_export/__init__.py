"""The open scene as arrays: what a bake gets.

Reads the evaluated scene, changes nothing.
"""
