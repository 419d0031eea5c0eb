# syntax=docker/dockerfile:1
# The server of fpmatch: docs/how-to/deploy.md says how to run it, the workflow `tests` tries it.
# Dependabot renews the digests, packaging/lock the versions and hashes. Not pinned is the
# compiler, Debian's current one: nothing of it enters the image but what it compiles.

FROM python:3.13-slim@sha256:9662417aace5ae7b8e2609cce472b72a8958e134ba372808abe9cc1a0c0125e6 AS build
RUN apt-get update && apt-get install --yes --no-install-recommends gcc libc6-dev \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /source
COPY packaging/requirements.lock packaging/
RUN python -m venv /opt/fpmatch \
    && /opt/fpmatch/bin/pip install --no-cache-dir --require-hashes --only-binary :all: \
        -r packaging/requirements.lock
COPY . .
# By the setuptools and Cython of the lock file. Compiled kernels, or no image: others are slow.
RUN FPMATCH_REQUIRE_KERNELS=1 /opt/fpmatch/bin/pip install --no-cache-dir --no-index --no-deps \
        --no-build-isolation . \
    && /opt/fpmatch/bin/pip uninstall --yes setuptools pip \
    && /opt/fpmatch/bin/python -m compileall -q /opt/fpmatch/lib

FROM python:3.13-slim@sha256:9662417aace5ae7b8e2609cce472b72a8958e134ba372808abe9cc1a0c0125e6
LABEL org.opencontainers.image.title="fpmatch" \
      org.opencontainers.image.description="Fingerprint verification and identification" \
      org.opencontainers.image.licenses="Apache-2.0"
COPY --from=build /opt/fpmatch /opt/fpmatch
ENV PATH=/opt/fpmatch/bin:$PATH XDG_CACHE_HOME=/var/cache
ENV PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1
# Galleries in files; prints that are prepared for searches.
RUN useradd --system --uid 10001 --home-dir /var/lib/fpmatch fpmatch \
    && install -d --owner fpmatch --mode 700 /var/lib/fpmatch /var/cache/fpmatch
USER fpmatch
WORKDIR /var/lib/fpmatch
VOLUME ["/var/lib/fpmatch", "/var/cache/fpmatch"]
EXPOSE 8000
HEALTHCHECK --interval=15s --timeout=5s --start-period=5m \
    CMD ["python", "-c", "from urllib.request import urlopen; urlopen('http://127.0.0.1:8000/ready', timeout=4)"]
ENTRYPOINT ["fpmatch", "serve", "--host=0.0.0.0", "--log=json"]
