"""What is kept beside a gallery so that it is searched fast: an index, and prepared prints."""
