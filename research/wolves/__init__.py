"""False match rates of parts of prints, random templates, and templates made to match."""
