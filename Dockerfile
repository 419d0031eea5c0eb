# syntax=docker/dockerfile:1
# fpmatch with its server: docker build -t fpmatch . ; docs/how-to/deploy.md says how to run it.

FROM python:3.13-slim AS build
RUN apt-get update && apt-get install --yes --no-install-recommends gcc libc6-dev \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /source
COPY packaging/requirements.lock packaging/
# The versions and hashes of the lock file, so that an image can be built again as it was.
RUN python -m venv /opt/fpmatch \
    && /opt/fpmatch/bin/pip install --no-cache-dir --require-hashes -r packaging/requirements.lock
COPY . .
# Compiled kernels, or no image: interpreted ones are slow.
RUN FPMATCH_REQUIRE_KERNELS=1 /opt/fpmatch/bin/pip install --no-cache-dir --no-deps . \
    && /opt/fpmatch/bin/python -m compileall -q /opt/fpmatch/lib

FROM python:3.13-slim
LABEL org.opencontainers.image.title="fpmatch" \
      org.opencontainers.image.description="Fingerprint verification and identification" \
      org.opencontainers.image.licenses="Apache-2.0"
COPY --from=build /opt/fpmatch /opt/fpmatch
ENV PATH=/opt/fpmatch/bin:$PATH PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1
RUN useradd --system --uid 10001 --home-dir /var/lib/fpmatch --create-home fpmatch
USER fpmatch
WORKDIR /var/lib/fpmatch
VOLUME /var/lib/fpmatch
EXPOSE 8000
HEALTHCHECK --interval=30s --timeout=5s --start-period=20s \
    CMD ["python", "-c", "import urllib.request as r; r.urlopen('http://127.0.0.1:8000/health', timeout=4)"]
ENTRYPOINT ["fpmatch"]
CMD ["serve", "--host", "0.0.0.0", "--port", "8000"]
