"""What users set: properties of scenes, preferences of the add-on, presets.

One property for each entry of the option table.
"""
