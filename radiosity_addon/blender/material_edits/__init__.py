"""Edits that users made on lightmap copies of materials, carried to the originals.

Also copies of earlier versions.
"""
