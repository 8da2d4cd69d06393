"""What memory there is: the least of what system, control group and process leave."""

import pytest
from metamer.runtime import memory
from metamer.runtime.memory import available_bytes


@pytest.fixture
def machine(tmp_path, monkeypatch):
    """A system with 8 GB available, and no group; both folders are there to be written to."""
    for name in ("proc", "group"):
        (tmp_path / name).mkdir()
    (tmp_path / "proc" / "meminfo").write_text("MemTotal: 16000000 kB\nMemAvailable: 8000000 kB\n")
    monkeypatch.setattr(memory, "_PROC", tmp_path / "proc")
    monkeypatch.setattr(memory, "_GROUP", tmp_path / "group")
    monkeypatch.setattr(memory, "_address_space", lambda: None)
    return tmp_path


def test_the_system_says_what_is_available(machine):
    assert available_bytes() == 8_192_000_000


def test_a_container_leaves_its_limit_less_what_it_holds(machine):
    (machine / "group" / "memory.max").write_text("3000000000\n")
    (machine / "group" / "memory.current").write_text("2500000000\n")
    (machine / "group" / "memory.stat").write_text("anon 1\ninactive_file 1000000000\n")
    assert available_bytes() == 1_500_000_000


def test_a_container_without_a_limit_leaves_what_the_system_has(machine):
    (machine / "group" / "memory.max").write_text("max\n")
    assert available_bytes() == 8_192_000_000


def test_a_system_that_says_nothing_refuses_nothing(machine, monkeypatch):
    monkeypatch.setattr(memory, "_system", lambda: None)
    assert available_bytes() is None


def test_this_machine_has_some_memory():
    assert (available_bytes() or 1) > 0
