"""The output folder, whose files are whose, and opening scene files.

Every file is written aside first.
"""
