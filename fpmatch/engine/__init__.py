"""Where the work of whole batches is done: in this process, on all cores, or on a cluster."""
