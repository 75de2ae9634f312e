"""The flow's stages on Dask workers, in the head's working copy or copies of their own."""
