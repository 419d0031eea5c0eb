"""Where the work of whole batches is done: in this process, or on all cores."""
