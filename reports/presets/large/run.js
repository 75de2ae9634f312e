run = {
  "written": "2026-11-27 00:06 UTC",
  "commit": "318d0b1a-dirty",
  "machine": "Intel(R) Xeon(R) Processor, 16 cores",
  "device": "cpu",
  "runs": "sling flow",
  "preset": "large",
  "seconds": 968,
  "stretches": 2,
  "python": "3.12.3",
  "numpy": "2.5.2",
  "scipy": "1.18.1",
  "warp-lang": "1.19.0",
  "cma": "4.5.0",
  "torch": "2.11.0",
  "rsl-rl-lib": "5.5.1",
  "pyarrow": "25.0.1",
  "dvc": "3.67.1"
}
