# tbcad in a container, with what it needs of Debian:
#   docker build -t tbcad .
#   docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/work" tbcad              # the paper's design
#   docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/work" tbcad init my.toml # any other command
FROM python:3.12-slim-bookworm

# The first four: without them the CAD kernel does not load. The others: for pictures.
RUN apt-get update \
    && apt-get install -y --no-install-recommends \
        libgl1 libx11-6 libxrender1 libegl1 \
        libgl1-mesa-dri xvfb xauth \
    && rm -rf /var/lib/apt/lists/*

COPY pyproject.toml README.md LICENSE /src/
COPY tbcad /src/tbcad
COPY designs /src/designs
COPY verify /src/verify
RUN pip install --no-cache-dir /src && rm -rf /src && tbcad --version

# Any user may run it: what libraries keep of earlier runs goes where everybody may write.
ENV HOME=/tmp
WORKDIR /work
ENTRYPOINT ["tbcad"]
CMD ["build", "--n", "18", "--out", "exports"]
