"""Formats of agencies: ANSI/NIST-ITL files, WSQ, minutiae records of 2009 and 2011."""
