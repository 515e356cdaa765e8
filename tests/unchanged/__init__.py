"""What the command line gave before the code was restructured, and the check that it still gives it."""
