"""Web interface to compare prints, and the HTTP API behind it.

`app.make_app` is the server as an ASGI application. A request passes `access` (hosts, tokens,
sizes, number), a route sends its bytes to the `pool`, and a worker process does the work, in
functions as thin as the commands of `fpmatch.cli`. Workers get bytes and numbers only; no upload is
written to a file.
"""
