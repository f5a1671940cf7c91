"""Elements: kinds, parts, strains, volumes; everything that a law of elements needs to know about them."""
