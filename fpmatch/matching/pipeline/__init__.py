"""The default matcher, compiled: two prepared prints become pairs, evidence and similarity."""
