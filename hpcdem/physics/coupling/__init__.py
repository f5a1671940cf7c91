"""Physics that act on each other: discs that touch the free faces of elements."""
