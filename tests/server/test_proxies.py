"""The files for nginx and Caddy of docs/how-to/deploy.md, run before a server."""

import re
import shutil
import socket
import ssl
import subprocess
from contextlib import suppress
from pathlib import Path

import httpx
import pytest

from fpmatch.server.settings import Limits

from .conftest import serving, wait_until

PAGE = Path(__file__).resolve().parents[2] / "docs/how-to/deploy.md"
NAME = "prints.example.org"


def block(beginning):
    """Return the one block of code of the page that begins so."""
    (text,) = re.findall(rf"```\w+\n({beginning}.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    return text


def nginx(folder, port, behind):
    """Return the command that runs the site of the page, as nginx includes it."""
    certificate = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1"]
    where = ["-subj", f"/CN={NAME}", "-keyout", folder / "key.pem", "-out", folder / "cert.pem"]
    subprocess.run([*certificate, *where], check=True, capture_output=True)
    site = block("limit_conn_zone").replace("listen 443", f"listen {port}")
    site = site.replace("/etc/ssl/prints.pem", f"{folder}/cert.pem")
    site = site.replace("/etc/ssl/prints.key", f"{folder}/key.pem")
    site = site.replace("127.0.0.1:8000", f"127.0.0.1:{behind}")
    temporary = "".join(
        f"{name}_temp_path {folder}/{name};\n"
        for name in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    )
    (folder / "nginx.conf").write_text(
        f"daemon off;\nmaster_process off;\npid {folder}/pid;\nerror_log stderr;\nevents {{}}\n"
        f"http {{\naccess_log off;\n{temporary}{site}}}\n"
    )
    return ["nginx", "-c", f"{folder}/nginx.conf", "-e", "stderr"]


def caddy(folder, port, behind):
    """Return the command that runs the site of the page, with a certificate of its own."""
    site = block(r"\{\n    servers").replace(NAME, f"{NAME}:{port}", 1)
    site = site.replace("127.0.0.1:8000", f"127.0.0.1:{behind}").rstrip().removesuffix("}")
    options = "admin off\nskip_install_trust\nauto_https disable_redirects\n"
    options += f"storage file_system {folder}/kept\n"
    (folder / "Caddyfile").write_text(f"{{\n{options}{site[2:]}    tls internal\n}}\n")
    return ["caddy", "run", "--adapter", "caddyfile", "--config", f"{folder}/Caddyfile"]


@pytest.mark.slow
@pytest.mark.parametrize("configured", [nginx, caddy])
def test_a_proxy_passes_requests_on_and_bounds_them(configured, sent, tmp_path):
    if shutil.which(configured.__name__) is None:
        pytest.skip(f"{configured.__name__} is not installed")
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    hosts, limits = (NAME, "127.0.0.1"), Limits(file_megabytes=2.0)
    options = {"verify": False, "trust_env": False, "headers": {"host": NAME}, "timeout": 60}
    sni = {"sni_hostname": NAME}
    unverified = ssl.create_default_context()
    unverified.check_hostname, unverified.verify_mode = False, ssl.CERT_NONE

    def answers():
        assert proxy.poll() is None, proxy.stdout.read()
        with suppress(httpx.TransportError):
            return client.get("/health", extensions=sni).json() == {"status": "ok"}

    with (
        serving(hosts=hosts, limits=limits) as server,
        httpx.Client(base_url=f"https://127.0.0.1:{port}", **options) as client,
        subprocess.Popen(
            configured(tmp_path, port, server.base_url.port),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        ) as proxy,
    ):
        try:
            wait_until(answers)
            slow = socket.create_connection(("127.0.0.1", port), 15)
            slow = unverified.wrap_socket(slow, server_hostname=NAME)
            slow.sendall(b"GET / HTTP/1.1\r\n")
            files = sent(probe="1_1.png", reference="1_1.png")
            same = client.post("/verify", files=files, extensions=sni)
            assert same.json()["identical"] == "pixels"
            # Caddy says that the server closed the connection: nginx reads all before it passes on
            large = client.post("/verify", content=bytes(67_000_000), extensions=sni)
            assert large.status_code in {413, 502}
            assert b"200" not in slow.recv(99)  # within 15 s
            slow.close()
        finally:
            proxy.terminate()
