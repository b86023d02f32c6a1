"""Skies: plain ones, images, and the Sky Texture."""
