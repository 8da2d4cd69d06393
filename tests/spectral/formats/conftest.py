"""Fixtures that the tests of readers share: writing small files, and refusals without the folder's name."""

import pytest
from metamer.runtime.errors import InputError


@pytest.fixture
def written(tmp_path):
    """Function that writes content, text or bytes, to a file of a name, and gives its path."""

    def write(content, name="paints.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.fixture
def refused(written):
    """Function that gives the lines of the refusal of a content by a reader, without the folder."""

    def refuse(read, content, name="paints.csv"):
        path = written(content, name)
        with pytest.raises(InputError) as caught:
            read(path)
        return str(caught.value).replace(f"{path.parent}/", "").splitlines()

    return refuse
