"""Geometry: whatever becomes a mesh when it is rendered."""
