"""Heat in elements: conduction, exchange with the surroundings, thermal stress."""
