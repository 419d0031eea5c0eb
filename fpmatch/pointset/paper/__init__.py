"""Point pattern matching by unit-circle parametrization (the paper's sections 3.2 and 3.3)."""
