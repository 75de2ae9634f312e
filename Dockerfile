# The whole project in a container. Not built where it was written: no registry of images is reached.
#     docker build -t sling2sim2real . && docker run --rm -v "$PWD/out:/work/reports" sling2sim2real
FROM python:3.11-slim-bookworm
RUN apt-get update \
 && apt-get install -y --no-install-recommends git make libgl1 libegl1 libgomp1 libidn2-0 libusb-1.0-0 libx11-6 \
 && rm -rf /var/lib/apt/lists/*
WORKDIR /work
COPY . .
RUN make setup
CMD ["make", "demo"]
