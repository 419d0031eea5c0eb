"""The paper's case study (section 4.1) on two prints, with its Figures 1, 3 and 8."""
