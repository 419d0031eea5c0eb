"""Training of the score, the quality and the enhancer; calibration of matchers."""
