"""What elements are made of: kinds, parts, strains, volumes; all that a law of elements needs to know of them."""
