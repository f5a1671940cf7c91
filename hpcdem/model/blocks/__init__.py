"""Blocks that deform and crack: their mesh, groups, properties and tables. Data without behaviour of its own."""
