"""Point pattern matching after van Wamelen, Li and Iyengar (2004)."""
