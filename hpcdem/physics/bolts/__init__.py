"""Rock bolts in blocks: bars of elements with one force along them, in grout that holds them to the rock."""
