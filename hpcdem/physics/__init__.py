"""Physics, a folder each: its arithmetic in kernels/, its state and step beside it."""
