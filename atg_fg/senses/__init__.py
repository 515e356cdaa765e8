"""What detectors and cameras say, as likelihoods: tags in images, calibrated cameras, and how a cube was turned."""
