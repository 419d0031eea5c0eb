"""Pictures of the documentation, contact sheets, and the data of ``sample_data``."""
