"""Several impressions of a finger, and several fingers: compare, consolidate, merge and fuse."""
