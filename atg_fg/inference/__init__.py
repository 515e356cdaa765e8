"""The recognition model and all that can be asked of it: tables, chain, factor graph, expected entropy, belief tree."""
