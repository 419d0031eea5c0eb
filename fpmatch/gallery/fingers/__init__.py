"""Several impressions of a finger, and several fingers of a subject: compare and fuse them."""
