"""Heat that flows through the contacts of discs: the worked example of physics on particles."""
