import hypothesis

# The same examples on every run: a test that passed yesterday fails today only if the code has changed.
hypothesis.settings.register_profile("atg-fg", derandomize=True, deadline=None, database=None, max_examples=60)
hypothesis.settings.load_profile("atg-fg")
