"""The laboratory: error rates of databases, synthetic prints and bare point sets."""
