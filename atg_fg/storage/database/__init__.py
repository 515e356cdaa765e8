"""A robot memory in one SQLite file: ATGs, learned structure, merges, and the record of every trial.

``schema.py`` has the tables, ``connection.py`` opens files and turns SQLite's errors into this project's; memories are
read by ``memory_reading.py`` and written by ``memory_writing.py``, trials and experiments by ``trial_rows.py``.
``keeper.py`` keeps an open memory and its file in step, one transaction a trial.
"""
