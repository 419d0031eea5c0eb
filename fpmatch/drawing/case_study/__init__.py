"""The paper's case study on two prints, with its Figures 1, 3 and 8: `case` draws it."""
