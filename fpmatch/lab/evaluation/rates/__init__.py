"""Error rates of scores, how far they scatter, and the files of scores of any matcher."""
