"""Columns of the tables of rates, for the help of the commands that print them."""

from typing import Final

RATES: Final = """\b
Columns:
  EER       equal error rate
  FMR100    false non-match rate where one impostor in 100 matches
  FMR1000   the same for one in 1,000
  FMR10000  the same for one in 10,000, where the pairs allow it
  ZeroFMR   the same where none matches
  ZeroFNMR  false match rate where no genuine pair is rejected
  d'        decidability: the distance of the means of genuine and impostor scores in units of
            their mean standard deviation
  rank-1    prints whose own finger comes first when each is searched among all others of its
            database; a finger counts by its most similar impression (protocol extended only)
  failed    images that gave no template (failures to extract); they score 0 in all their pairs
  extract   median CPU time to extract an image
  match     median CPU time to compare two prepared templates

\b
The 95 % intervals come from the bootstrap over the fingers of each database: how far the rates
would scatter with other fingers. A rate of 0 or 100 % has one limit, for which each finger is one
trial: "at most 25.89 % (0 of 10)", 95 %, one-sided, by Clopper and Pearson; about 3 / n (rule of
3). For the EER a trial is a pair of fingers, each finger in one pair. ZeroFMR and ZeroFNMR, which
depend on one score, have no interval.
"""
