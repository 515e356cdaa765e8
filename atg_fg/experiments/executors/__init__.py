"""Where tests run: one after another, in processes, in threads, or on a dask cluster."""
