"""A local page on which prints are compared by eye and by score, and the HTTP API behind it.

`app.make_app` is the whole server as an ASGI application. A request passes the `guard` (who may
ask, how much, how often), a route hands its bytes to the `pool`, and a worker process does the
work, in functions that are as thin as the commands of `fpmatch.cli`. Workers are told nothing but
bytes and numbers; no upload gets a name or a place on this machine.
"""
