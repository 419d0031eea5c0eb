"""The paper's experiment on random point sets: matchers, trials, results, tables and targets."""
