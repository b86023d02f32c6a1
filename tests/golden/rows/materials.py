"""Materials: what reflects, lets through and glows, and how much of it."""
