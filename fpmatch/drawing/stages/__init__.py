"""Pictures of the stages of an extraction: one by one, and all on one sheet."""
