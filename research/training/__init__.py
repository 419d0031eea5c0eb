"""Training of the score, the quality, the polarity and the enhancer; calibration of matchers."""
