"""Memory that there is: the least of what system, control group and process leave."""

from types import SimpleNamespace

import psutil
import pytest
from metamer.runtime import memory
from metamer.runtime.memory import available_bytes


@pytest.fixture
def machine(tmp_path, monkeypatch):
    """A system with 8 GB available, and no group, whose folder is there to be written to."""
    (tmp_path / "group").mkdir()
    monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(available=8_192_000_000))
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


def test_a_limit_on_addresses_leaves_what_is_not_used():
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_AS)
    used = psutil.Process().memory_info().vms
    try:
        resource.setrlimit(resource.RLIMIT_AS, (used + 2_000_000_000, before[1]))
        assert 1_000_000_000 < (memory._address_space() or 0) <= 2_000_000_000
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def test_this_machine_has_some_memory():
    assert (available_bytes() or 1) > 0
