"""The files of a gallery: rows of the database, templates in few bytes, history, audit."""
