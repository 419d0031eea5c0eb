"""The figures of the paper, drawn from any point sets by matplotlib: `figures` draws them all."""
