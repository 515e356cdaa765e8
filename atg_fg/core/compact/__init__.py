"""Large memories as arrays: ATGs in columns, and an index from patterns to the ATGs that know them."""
