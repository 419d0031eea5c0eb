"""Attacks by anyone on the network, and by clients with a token."""

from __future__ import annotations

import json
import os
import signal
import socket
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

from research.attacks.requests import form_of, post_head
from research.attacks.server import resident_mb
from research.promises.attack import attack
from research.promises.files import NASTY, extreme_templates
from research.promises.program import KEY, PROBE, database, templates
from research.promises.web import IMAGE, PAIR, ROLES, ROUTES, descendants, served, workers_of

if TYPE_CHECKING:
    from research.promises.attack import Tries
    from research.promises.program import Place
    from research.promises.web import Web

_Asked = tuple[str, dict[str, object] | bytes, dict[str, str]]
_HEAD: Final = b"POST /verify HTTP/1.1\r\nhost: localhost\r\n"


def _upload(body: bytes, address: str = "/verify") -> bytes:
    return post_head(address, f"content-length: {len(body)}") + body


@attack("A server listens on this computer only")
def open_doors(place: Place) -> Tries:
    """Connect from other addresses; request all without a token and with wrong ones."""
    with served(place) as web:
        others = {str(info[4][0]) for info in socket.getaddrinfo(socket.gethostname(), None)}
        for other in {*others, "127.0.0.2"} - {"127.0.0.1", "::1"}:
            answer = web.ask("GET /about", host=other)
            yield answer.status == 0 or f"{other}: {answer}"
        yield web.ask("GET /about").status == 200 or "loopback needs a token"
    token = "Wn-FOYJvW3B3A0nUqVYxw"
    wrong = ["", "Bearer", "Bearer ", f"Bearer {token[:-1]}", f"Bearer {token}a", f"Basic {token}"]
    wrong += [f"Bearer {token.lower()}", f"Bearer {token},{token}", "Bearer \xff"]
    with served(place, "--host", "0.0.0.0", "--token", token) as web:
        for what in ROUTES:
            for header in place.random.sample(wrong, 3):
                answer = web.ask(what, headers={"authorization": header})
                yield answer.status == 401 or f"{what} {header!r}: {answer}"
            answer = web.ask(f"{what}{'&' if '?' in what else '?'}token={token}")
            yield answer.status == 401 or f"{what} with the token in the address: {answer}"


@attack("A client may request what its role includes")
def roles(place: Place) -> Tries:
    """Request each address with the tokens of four roles, also in other spellings."""
    clients = (f'[{role}]\nrole = "{role}"\ntoken = "{role * 5}"\n' for role in ROLES)
    place.write("server.toml", "".join(clients)).chmod(0o600)
    with served(place, "--settings", "server.toml") as web:
        for role in ROLES:
            sent = {"authorization": f"Bearer {role * 5}"}
            for what, (needed, form) in ROUTES.items():
                if ROLES.index(role) >= ROLES.index(needed):
                    answer = web.ask(what, form, sent)
                    yield answer.status in (200, 201, 404) or f"{role}: {what}: {answer}"
                    continue
                for spelled in (what, what.replace(" /", " //"), f"{what}/", what.upper()):
                    answer = web.ask(spelled, form, sent)
                    yield answer.status in (403, 404, 405, 422) or f"{role}: {spelled}: {answer}"
            for header in ("x-http-method-override", "x-method-override", "x-original-url"):
                answer = web.ask("GET /gallery/15", headers={**sent, header: "DELETE"})
                yield answer.status in (404, 405) or f"{role} {header}: {answer}"


@attack("The page of another site")
def other_sites(place: Place) -> Tries:
    """Send foreign hosts and origins, as browsers do; look at the headers of all answers."""
    hosts = ["evil.example", "localhost.evil.example", "127.0.0.1.evil.example", "evil.example:80"]
    hosts += ["127.0.0.1@evil.example", "[::1].evil.example", "127.0.0.1, evil.example", "", "*"]
    with served(place) as web:
        sites = [{"origin": f"http://127.0.0.1:{web.port + 1}"}, {"origin": "null"}]
        sites += [{"origin": f"http://{host}"} for host in hosts if host]
        sites += [{"sec-fetch-site": site} for site in ("cross-site", "same-site")]
        for host in hosts:
            for what in ("GET /about", "POST /verify", "GET /"):
                answer = web.ask(what, headers={"host": host})
                yield answer.status in (400, 421) or f"host {host!r} {what}: {answer}"
        for sent in sites:
            for what in ("POST /enrol", "POST /verify", "DELETE /gallery/16"):
                answer = web.ask(what, headers=sent)
                yield answer.status == 403 or f"{sent} {what}: {answer}"
            for what in ("GET /about", "GET /", "OPTIONS /enrol"):
                headers = web.ask(what, headers=sent).headers
                safe = headers.get("cross-origin-resource-policy") == "same-origin"
                safe &= "frame-ancestors 'none'" in headers.get("content-security-policy", "")
                shared = any(name.startswith("access-control") for name in headers)
                yield (safe and not shared) or f"{sent} {what}: {headers}"


@attack("Names that clients give never become places")
def client_names(place: Place) -> Tries:
    """Give files, labels and addresses names of folders; look for what appears or is read."""
    place.write("secret.txt", "the secret")
    place.write("../secret.txt", "the secret")
    names = ["../owned.tif", "/tmp/owned.tif", "..\\owned.tif", "C:\\owned.tif", "owned\0.tif"]
    names += ["%2e%2e%2fowned", "file:///tmp/owned", "|touch owned", "$(touch owned)", "~/owned"]
    with served(place) as web:
        for name in names:
            web.ask("POST /enrol", {"image": (name, PROBE.read_bytes() + b"\1"), "subject": name})
            web.ask(
                "POST /case-report", {**PAIR, "probe": (name, PROBE.read_bytes()), "notes": name}
            )
            owned = [*place.folder.parent.rglob("*owned*"), *Path("/tmp").glob("owned*")]
            yield not owned or f"{name!r} made {owned}"
        for up in (
            "../",
            "%2e%2e/",
            "..%2f",
            "....//",
            "static/../../",
            "//",
            "..%5c",
            "%252e%252e/",
        ):
            for file in ("secret.txt", "plain.db", "../secret.txt", "etc/passwd"):
                answer = web.ask(f"GET /{up}{file}")
                leaked = any(word in answer.body for word in (b"secret", b"SQLite", b"root:"))
                yield not (leaked or answer.status == 200) or f"GET /{up}{file}: {answer}"


@attack("Uploads leave nothing in the temporary folder")
def leftovers(place: Place) -> Tries:
    """Send whole, broken, large and aborted uploads; look into the folder after each."""
    large = {**PAIR, "reference": ("b.bmp", b"BM" + bytes(9_000_000))}
    broken = {**PAIR, "probe": ("a.tif", PROBE.read_bytes()[:9000])}
    temporary = place.folder / "tmp"
    with served(place) as web:
        for k in range(16):
            body = form_of((PAIR, large, broken)[k % 3])
            end = place.random.randrange(len(body)) if k % 2 else len(body)
            with web.connect(_upload(body)[: end + 200]) as opened:
                if end == len(body):
                    opened.recv(100)
            time.sleep(0.1)
            names = [path.name for path in temporary.rglob("*") if path.is_file()]
            yield not names or f"left {names}"
    yield not list(temporary.iterdir()) or f"left at the end {list(temporary.iterdir())}"


@attack("Requests are bounded in size, number and time")
def large_requests(place: Place) -> Tries:
    """Send bodies, forms and headers of up to 120 MB, then 150 verifications at once."""
    limits = place.write("server.toml", "[limits]\nwait_seconds = 2\n")
    with served(place, "--settings", limits) as web:
        web.ask("POST /verify")
        memory = resident_mb(web.pid)
        for form in (
            {**PAIR, "probe": ("a.tif", bytes(40_000_000))},
            {**PAIR, "fmr": "1" * 40_000_000},
            {**PAIR, **{f"field{k}": "" for k in range(30_000)}},
            {f"file{k}": ("a", bytes(20_000_000)) for k in range(6)},
        ):
            answer = web.ask("POST /verify", form)
            yield answer.status in (0, 400, 408, 413, 422) or str(answer)
            grown = resident_mb(web.pid) - memory
            yield grown < 150 or f"the memory of the server grew by {grown:.0f} MB"
        for size in (99_000, 900_000, 9_000_000):
            answer = web.ask("GET /about", headers={"x": "a" * size})
            yield answer.status in (0, 400, 408, 413, 431) or f"a header of {size} bytes: {answer}"
        start = time.monotonic()
        with ThreadPoolExecutor(150) as threads:
            answers = list(threads.map(lambda _: web.ask("POST /verify"), range(150)))
        took = time.monotonic() - start
        yield from (one.status in (200, 503) or str(one) for one in answers)
        yield took < 60 or f"150 requests took {took:.0f} s"


@attack("A client that sends its header or its body slowly")
def slow_clients(place: Place) -> Tries:
    """Hold 30 headers, 30 bodies and 6 unread answers: others are answered, these end in 25 s."""
    with served(place) as web:
        usual = _seconds(web)
        body = _upload(form_of(PAIR))[:900]
        slow = [web.connect(part) for part in (_HEAD, body) for _ in range(30)]
        unread = [web.connect(_upload(form_of(PAIR), "/compare")) for _ in range(6)]
        for _ in range(8):
            seconds = _seconds(web)
            yield seconds < max(3.0, 10 * usual) or f"a verification took {seconds:.1f} s"
        time.sleep(25)
        for one in (*slow, *unread):
            yield not _is_open(one) or "a slow client is still connected"
            one.close()


def _seconds(web: Web) -> float:
    start = time.monotonic()
    answer = web.ask("POST /verify")
    return time.monotonic() - start if answer.status == 200 else 99.0


def _is_open(one: socket.socket) -> bool:
    one.settimeout(0.01)
    try:
        while one.recv(90_000):
            pass
    except TimeoutError:
        return True
    except OSError:
        pass
    return False


@attack("One client has no more connections than its limit")
def many_connections(place: Place) -> Tries:
    """Open 90 connections of three addresses, with limits of 8 for each and 20 for all."""
    text = "[limits]\nconnections_per_client = 8\nconnections = 20\n"
    with served(place, "--settings", place.write("server.toml", text)) as web:
        opened: dict[str, list[socket.socket]] = {}
        for source in ("127.0.0.2", "127.0.0.3", "127.0.0.4"):
            opened[source] = [web.connect(b"GET /health", source) for _ in range(30)]
            yield web.ask("GET /health").status == 200 or "another client is not answered"
        time.sleep(3)
        alive = {source: sum(map(_is_open, some)) for source, some in opened.items()}
        yield max(alive.values()) <= 8 or f"connections that are open: {alive}"
        yield sum(alive.values()) <= 20 or f"connections that are open: {alive}"
        size = web.log.stat().st_size
        yield size < 20_000 or f"the log has {size} bytes"
        for one in (one for some in opened.values() for one in some):
            one.close()


@attack("A gallery that does not answer")
def hanging_gallery(place: Place) -> Tries:
    """Hold the file of the gallery; request readiness, work with it, and work without it."""
    gallery = place.gallery()
    with served(place) as web, ThreadPoolExecutor(8) as threads:
        usual = _seconds(web)
        with database(gallery) as opened:
            opened.execute("BEGIN EXCLUSIVE")
            asked = [threads.submit(web.ask, what) for what in ("GET /ready", "POST /identify") * 4]
            for _ in range(8):
                seconds = _seconds(web)
                yield seconds < max(2.0, 2 * usual) or f"a verification took {seconds:.1f} s"
            start = time.monotonic()
            answer = web.ask("GET /ready")
            seconds = time.monotonic() - start
            yield (answer.status == 503 and seconds < 2.5) or f"after {seconds:.1f} s: {answer}"
            answers = [one.result() for one in asked]
            opened.rollback()
        time.sleep(3)  # an answer of readiness holds for a second
        yield from (one.status in (200, 500, 503) or str(one) for one in answers)
        answer = web.ask("POST /identify")
        yield answer.status == 200 or f"when it answers again: {answer}"


@attack("Work that ends its worker process")
def killed_workers(place: Place) -> Tries:
    """Kill a worker process while it is idle, and all while they work."""
    with served(place) as web:
        web.ask("POST /verify")
        for k in range(12):
            idle = place.random.sample(workers_of(web.pid), 1)
            _kill(idle)
            while idle[0] in descendants(web.pid):
                time.sleep(0.01)
            time.sleep(0.3 * (k % 2))
            answer = web.ask("POST /verify")
            yield answer.status == 200 or f"after an idle process was killed: {answer}"
        for _ in range(4):
            with ThreadPoolExecutor(1) as threads:
                asked = threads.submit(web.ask, "POST /stages")
                time.sleep(place.random.uniform(0.0, 0.2))
                _kill(workers_of(web.pid))
            answer = asked.result()
            yield answer.status in (200, 500, 503) or f"killed at work: {answer}"
            answer = web.ask("POST /verify")
            yield answer.status == 200 or f"after a process at work was killed: {answer}"


def _kill(processes: list[int]) -> None:
    for pid in processes:
        with suppress(OSError):
            os.kill(pid, signal.SIGKILL)


@attack("Extreme numbers, control characters and blanks")
def hostile_fields(place: Place) -> Tries:
    """Send hostile numbers and texts in fields and addresses; each is refused in one line."""
    numbers = ("nan", "inf", "1e400", "-1", " ", "0x10", "9" * 400, "1\0", "[]", "1,5", "5\n")
    texts = (NASTY, "a\nb", "\0", "\x7f", "a" * 5000, " ", "\u202e", b"\xed\xa0\x80")
    fields = dict.fromkeys(("dpi", "probe_dpi", "fmr", "threshold"), "/verify")
    with served(place) as web:
        for field, address in (*fields.items(), ("candidates", "/identify"), ("fmr", "/views")):
            for value in numbers:
                form = {**ROUTES[f"POST {address}"][1], field: value}
                answer = web.ask(f"POST {address}", form)
                yield answer.refused is True or f"{field}={value!r}: {answer}"
        for field in ("subject", "finger", "impression", "matcher", "enhance"):
            what, form = (
                ("POST /enrol", IMAGE)
                if field in "subject finger impression"
                else ("POST /overlay", PAIR)
            )
            for text in texts:
                answer = web.ask(what, {**form, field: text})
                yield answer.refused is True or f"{field}={text!r}: {answer}"
        for number in ("-1", "0", "1e3", "9" * 30, "%00", "1%0a", "%20"):
            answer = web.ask(f"POST /gallery/{number}/compare", ROUTES["POST /identify"][1])
            yield answer.refused is True or f"number {number}: {answer}"


@attack("A template outside the bounds is refused")
def hostile_templates(place: Place) -> Tries:
    """Send templates with an extreme number each to be enrolled; search for what is stored."""
    gallery = place.gallery()
    with served(place) as web:
        for k, text in enumerate(extreme_templates(place)):
            count = len(templates(gallery))
            file = (f"{1000 + k}_1.json", text)
            answer = web.ask("POST /enrol", {"image": (file[0], text.encode())})
            stored = len(templates(gallery)) - count
            yield stored == (answer.status == 201) or f"{text[:200]}: {answer}"
        answer = web.ask("POST /identify")
        yield (answer.status == 200 and json.loads(answer.body)["damaged"] == 0) or str(answer)


@attack("No answer contains the place of a gallery")
def told_places(place: Place) -> Tries:
    """Request all before and after the gallery is damaged; look for folders and libraries."""
    gallery = place.gallery()
    words = [str(place.common), "sqlite", "Traceback", "site-packages", ".py", "sqlalchemy"]
    words += ["psycopg", 'File "', "No such file", "malformed", "/root"]
    broken = {"probe": ("a.tif", b"II*\0" + bytes(40))}
    with served(place) as web:
        for damage in (None, gallery.read_bytes()[:4096] + place.random.randbytes(99_000), b""):
            if damage is not None:
                gallery.write_bytes(damage)
            for what in (*ROUTES, "GET /ready", "GET /no", "POST /gallery/999/compare"):
                for form in (None, broken):
                    answer = web.ask(what, form)
                    text = f"{answer.headers} {answer.body.decode(errors='replace')}".lower()
                    told = [word for word in words if word.lower() in text]
                    yield not told or f"{what}: {told} {answer}"


@attack("What an address does not take is refused")
def unknown_requests(place: Place) -> Tries:
    """Send unknown and repeated fields, other methods and bodies, and matchers by their place."""
    methods = {"GET", "POST", "DELETE", "PUT", "PATCH", "TRACE", "PROPFIND"}
    with served(place) as web:
        for what, (_, form) in ROUTES.items():
            method, address = what.split()
            base, mark = address.partition("?")[0], "&" if "?" in address else "?"
            asked: list[_Asked] = [(f"{what}{mark}treshold=1", form, {})]
            known = {one.split()[0] for one in ROUTES if one.split()[1].partition("?")[0] == base}
            known |= {"DELETE"} if base.startswith("/gallery/2") else set()
            asked += [(f"{other} {base}", form, {}) for other in methods - known]
            if method == "POST":
                asked += [
                    (what, {**form, "treshold": "1"}, {}),
                    (what, {**form, "dpi": [1, 2]}, {}),
                ]
                for kind in ("application/json", "text/plain", "multipart/form-data", ""):
                    asked.append((what, b'{"a": 1}', {"content-type": kind}))
                for matcher in ("os:system", "fpmatch.cli:main", "../a.py:M", "builtins:eval"):
                    asked.append((what, {**form, "matcher": matcher}, {}))
            for one, sent, headers in asked:
                answer = web.ask(one, sent, headers)
                yield answer.refused is True or f"{one} {headers}: {answer}"


@attack("A key file that is replaced while a server runs")
def replaced_keys(place: Place) -> Tries:
    """Put another key into the file of a running server, request the gallery, put it back."""
    gallery, file = place.gallery(kind="sealed"), place.folder / "keys.txt"
    before, right = templates(gallery), file.read_text()
    with served(place, "--key", KEY) as web:
        yield web.ask("POST /identify").status == 200 or "the key is not used"
        file.unlink()
        place.done("key", "keys.txt", "--new")
        for what in ("POST /enrol", "POST /gallery/2/compare", "POST /gallery/verify"):
            answer = web.ask(what)
            refused = answer.status >= 400 and json.loads(answer.body)["error"].isprintable()
            yield (refused and templates(gallery) == before) or f"{what}: {answer}"
        place.write("keys.txt", right)
        answer = web.ask("POST /identify")
        yield answer.status == 200 or f"when it is back: {answer}"


@attack("Errors of a database contain no password")
def passwords(place: Place) -> Tries:
    """Give each command addresses with a password of databases that are not there."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
    hosts = (f"127.0.0.1:{port}/x", f"127.0.0.1:{port}/a b?x=1", "127.0.0.1:99999/x", "[/x")
    commands = """identify {} P
        enrol {} P
        gallery list --summary {}
        gallery check {}
        gallery audit show {}
        gallery rewrite {}
        extract --gallery {} -o out
        verify --gallery {} --subject 1 P
        score --references {} --probes {} -o s.csv
        synth --templates {}
        serve --gallery {}"""
    for command in commands.splitlines():
        for host in place.random.sample(hosts, 2):
            end = place.random.choice(("", "%40x", "@x", "/#", "&b"))
            url = f"postgresql://user:Geheim-passw0rd{end}@{host}"
            words = [PROBE if word == "P" else word.replace("{}", url) for word in command.split()]
            run = place.run(*words, timeout_s=30)
            told = "passw0rd" in run.out + run.err
            yield f"{host} told {run}" if told else run.refused
