"""Flow of a fluid in fractures: a network of channels on the joints between blocks."""
