import pytest


@pytest.fixture
def written(tmp_path):
    def write(text, name="looks.csv"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write
