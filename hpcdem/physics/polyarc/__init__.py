"""Bodies bounded by circular arcs: their outlines, moments, and the gap between two of them."""
