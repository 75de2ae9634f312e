"""Notes in $CONNECTIONS what this process connects to or looks up; Python runs this first where it
lies on PYTHONPATH.
"""

import os
import sys

LOCAL = ("127.0.0.1", "localhost", None)


def note(event: str, arguments: tuple) -> None:
    if event == "socket.connect" and isinstance(arguments[1], tuple):
        host = arguments[1][0]
    elif event == "socket.getaddrinfo":
        host = arguments[0]
    else:
        return
    host = host.decode() if isinstance(host, bytes) else host
    if host not in LOCAL:
        with open(os.environ["CONNECTIONS"], "a", encoding="utf-8") as file:
            file.write(f"{event} {host}\n")


sys.addaudithook(note)
