"""Two pictures in XYZ, as a page's row names them: wiped, probed, and not in another light."""

import numpy as np

SIZE = (920, 560)


def check_both_are_seen(it):
    it.settled()
    assert it.session.compare.mode == "wipe" and it.session.observer == "1964_10"
    it.frames(3)
    assert it.window.statistics[0].mean > 0.5


def check_a_probe_tells_the_colours_of_both(it):
    it.point(0.55, 0.5)
    it.settled()
    it.wait(lambda: it.window.probing.cursor is not None, "colours")
    first, second = it.window.probing.cursor.readings
    assert first.spectra is None and first.light == "A"
    np.testing.assert_allclose(second.xyz, 1.1 * first.xyz, rtol=1e-5)
    it.frames(3)


def check_another_light_is_refused_in_words(it):
    it.key("2")
    it.frames(3)
    assert "in one light" in it.said
    it.key("Ctrl+Z")
    it.frames(3)
