"""One print read, two prints compared, and the result in words and as a dict.

`reading` takes images and template files, `pair` compares two as commands and the web interface
request it, and `report` and `words` tell people and programs the result.
"""
