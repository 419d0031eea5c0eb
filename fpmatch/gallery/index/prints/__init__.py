"""Many prints in flat arrays of few bytes: chosen and compared at once."""
