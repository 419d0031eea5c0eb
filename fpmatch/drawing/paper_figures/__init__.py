"""Pictures of the paper's figures, from the functions that the matcher uses."""
