"""`metamer doctor`: what there is, and the line that installs what is missing."""

import sys

import pytest
from metamer.runtime.distribution import system_hint
from metamer.viewer.gl.context import SYSTEM_PACKAGES


def test_without_gl_it_names_the_packages_and_the_line_that_installs_them(metamer, monkeypatch):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    code, out, _ = metamer("doctor", "--brief")
    assert code == 0
    assert "renderer: software (numpy)" in out
    assert "METAMER_NO_GL is set" in out
    assert system_hint(SYSTEM_PACKAGES) in out


def test_a_system_without_apt_is_not_told_to_use_it(metamer, monkeypatch, tmp_path):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    monkeypatch.setenv("PATH", str(tmp_path))
    _, out, _ = metamer("doctor", "--brief")
    assert "apt-get" not in out and "libegl1, libgl1-mesa-dri" in out


def test_with_gl_it_names_version_and_device(metamer, gl):
    code, out, _ = metamer("doctor", "--brief")
    assert code == 0
    assert f"renderer: OpenGL {gl.version_code / 100:.1f}" in out
    assert gl.info["GL_RENDERER"] in out


@pytest.mark.parametrize("brief", [True, False])
def test_display_and_reference_are_described(metamer, monkeypatch, brief):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    _, out, _ = metamer("doctor", *["--brief"] * brief)
    assert "Un-tone-mapped" in out and "Embree rays" in out
    assert ("colour-science" in out) is not brief


def test_missing_library_is_named_with_its_install_line(metamer, monkeypatch):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    monkeypatch.setattr("metamer.cli.doctor._LIBRARIES", ("numpy", "no-such-library"))
    _, out, _ = metamer("doctor")
    assert "no-such-library missing: pip install no-such-library" in out


def test_missing_embree_is_named(metamer, monkeypatch):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    monkeypatch.setitem(sys.modules, "embreex", None)
    _, out, _ = metamer("doctor", "--brief")
    assert "reference: rays in numpy, some hundred times slower" in out and "no Embree: pip install embreex" in out


def test_missing_moderngl_is_named(metamer, monkeypatch):
    monkeypatch.setitem(sys.modules, "moderngl", None)
    code, out, _ = metamer("doctor", "--brief")
    assert code == 0 and "renderer: software (numpy)" in out
    assert "try: pip install moderngl" in out and "libegl1" not in out


def test_unusable_display_configuration_does_not_hide_the_rest(metamer, monkeypatch, tmp_path):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    monkeypatch.setenv("OCIO", str(tmp_path / "missing.ocio"))
    code, out, _ = metamer("doctor", "--brief")
    assert code == 4
    assert "missing.ocio" in out and "Embree rays" in out


def test_what_is_kept_from_run_to_run_is_said_and_cleared(metamer, monkeypatch, tmp_path):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    kept = tmp_path / "metamer" / "visibility"
    kept.mkdir(parents=True)
    with (kept / "one.npz").open("wb") as file:
        file.truncate(300_000_000)
    code, out, _ = metamer("doctor", "--brief")
    assert code == 0 and f"cache: {kept}, 1 file, 0.3 GB of at most 1 GB" in out and (kept / "one.npz").is_file()
    rays = tmp_path / "metamer" / "transfer"
    rays.mkdir()
    (rays / "one-00000.npz").write_bytes(b"x")
    assert f"{rays}, 1 file" in metamer("doctor", "--brief")[1]
    code, out, _ = metamer("doctor", "--brief", "--clear-cache")
    assert code == 0 and out.count("0 files, 0 GB") == 2 and [*kept.iterdir(), *rays.iterdir()] == []


def test_a_limit_of_the_cache_that_is_no_size_is_said(metamer, monkeypatch):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    monkeypatch.setenv("METAMER_CACHE_GB", "a lot")
    code, out, _ = metamer("doctor", "--brief")
    assert code == 4 and "METAMER_CACHE_GB" in out and "a lot" in out
