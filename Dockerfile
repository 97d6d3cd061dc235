# The checkout with all that its tests and the demo need. CI does not build it.
#
#   docker build -t caregiver_mj .
#   docker run --rm caregiver_mj                                                          # the tests
#   docker run --rm -v "$PWD:/out" caregiver_mj bash -c "scripts/demo && cp -r demo /out" # the demo, and what it leaves
FROM python:3.11-slim

# What draws without a display: all that scripts/_setup.sh would get through apt.
RUN apt-get update \
    && apt-get install -y --no-install-recommends libegl1 libgl1-mesa-dri \
    && rm -rf /var/lib/apt/lists/*

WORKDIR /caregiver_mj
COPY . .
RUN PIP_NO_CACHE_DIR=1 bash -c "source scripts/_setup.sh"
CMD ["scripts/test"]
