"""Geological sections: named polygons and lines with attributes, from drawings, maps and images, and out again."""
