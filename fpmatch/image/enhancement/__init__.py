"""Enhancement: orientation, period and contrast of the ridges, by a network or by Gabor filters."""
