"""Templates of synthetic fingers by the million, made without drawing images."""
