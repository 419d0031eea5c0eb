"""Where the work of whole batches is done: in this process, in several, or on a cluster."""
