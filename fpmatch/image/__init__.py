"""From a grey image to the minutiae of a print.

`extract` lists the stages; each stage is a module of one of the packages here.
"""
