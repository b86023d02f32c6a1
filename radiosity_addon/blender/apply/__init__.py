"""Putting lightmaps on objects, carrying edits over, and taking the bake off again.

Restore and the next bake use the same steps.
"""
