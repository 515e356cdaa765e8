from importlib.util import find_spec

# Of the optional extra 'vision'.
collect_ignore_glob = [] if find_spec("cv2") else ["test_*.py"]
