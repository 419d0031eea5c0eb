"""Commands of the laboratory: evaluate, synth, calibrate, points."""
