"""A recorded trial, a test or the result of an experiment as one self-contained HTML page (``atg-fg report``)."""
