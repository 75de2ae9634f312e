run = {
  "written": "2026-11-26 17:59 UTC",
  "commit": "02f81a76-dirty",
  "machine": "Intel(R) Xeon(R) Processor, 2 cores",
  "device": "cpu",
  "runs": "sling flow",
  "preset": "paper",
  "seconds": 2304,
  "stretches": 1,
  "python": "3.11.7",
  "numpy": "2.4.6",
  "scipy": "1.17.1",
  "warp-lang": "1.19.0",
  "cma": "4.5.0",
  "torch": "2.13.0+cpu",
  "rsl-rl-lib": "5.5.1",
  "pyarrow": "26.0.1",
  "dvc": "3.67.1"
}
