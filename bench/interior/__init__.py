"""An office with windows, lamps, furniture and plants, built by this package alone."""
