"""What runs a model, whatever its physics: what is due between steps, output."""
