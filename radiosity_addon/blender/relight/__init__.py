"""Relighting in Blender: kept bakes, rewriting lightmaps in place, Live, undo.

Images and files always belong together.
"""
