"""The scripts of the steps, each with one thread of BLAS.

The sums of several threads round otherwise, and DVC would see another result on a machine with more
cores. Our own threads, which change no bit, are as many as SLING_WORKERS says.
"""

import gc
import os
import sys

from sling2sim2real.base import home
from sling2sim2real.base.errors import UserError

gc.set_threshold(100_000)  # while torch loads, a tenth or more of the time looked for garbage

os.environ["PYDANTIC_DISABLE_PLUGINS"] = "__all__"  # it would seek them in all packages
os.environ["OPENBLAS_NUM_THREADS"] = "1"  # NumPy's and SciPy's; read when they are imported
try:
    home.settle()
except UserError as error:
    sys.exit(f"error: {error}")
