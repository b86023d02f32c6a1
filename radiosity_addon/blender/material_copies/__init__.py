"""Copies of materials that show a lightmap.

Originals are never changed; a copy says what it was when it was made.
"""
