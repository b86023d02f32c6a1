"""The tab *Radiosity* in the sidebar, and what is shown in the Properties editor.

Nothing here computes.
"""
