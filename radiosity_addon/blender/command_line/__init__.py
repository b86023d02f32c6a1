"""What the command line's verbs do inside Blender.

`main.py` runs one command and turns however it ends into an exit code.
"""
