"""The page on lines seen from a robot: what its derivation binds, and that it is the reference's."""

import numpy as np
import sympy as sp
from page import Page, steps

from roboloc_reference.lines import normalize_line_parameters, transform_line_to_scanner_frame

SYMBOLS = ("alpha", "r", "x", "y", "theta", "x_cam", "y_cam", "theta_cam")
PAGE = Page(
    "lines-seen-from-a-robot",
    "ekf-localization/line-measurements",
    steps("line", "symbols h jacobian sides"),
    choices=1,
)


def test_the_page_is_a_derivation_with_a_notebook():
    """Its tagged cells come in the notebook's order, assert what they say, and the notebook is there to download."""
    PAGE.hold()


def test_derivation_cells_bind_what_the_notebook_uses():
    """The tagged cells bind the symbols by their names, h and its Jacobian."""
    space = PAGE.bound
    assert all(space[name] == sp.Symbol(name, real=True) for name in (*SYMBOLS, "u", "v"))
    assert (space["h"].shape, space["H_x"].shape, space["other"].shape) == ((2, 1), (2, 3), (2, 1))


def test_derivation_is_what_the_reference_computes():
    """The page's h, its Jacobian and the other name of the line agree with the reference at random points."""
    space, rng = PAGE.bound, np.random.default_rng(3)
    symbols = [space[name] for name in SYMBOLS]
    forms = sp.lambdify(symbols, [space["h"], space["H_x"], space["other"]])
    for numbers in rng.uniform(-2, 2, (20, 8)):
        line, pose, tf = numbers[:2], numbers[2:5], numbers[5:]
        h, H_x, other = (np.array(form, dtype=float) for form in forms(*numbers))
        right, right_Hx = transform_line_to_scanner_frame(line, pose, tf)
        np.testing.assert_allclose(h.ravel(), right, atol=1e-13)
        np.testing.assert_allclose(H_x, right_Hx, atol=1e-13)
        for one in (h, other):
            (alpha, r), _ = normalize_line_parameters(one.ravel(), H_x)
            wanted, _ = normalize_line_parameters(right, right_Hx)
            np.testing.assert_allclose(r * np.exp(1j * alpha), wanted[1] * np.exp(1j * wanted[0]), atol=1e-13)


def test_the_page_does_not_answer_the_notebook():
    """Nothing on the page differentiates by the mounting or mirrors the scanner: the notebook asks for that."""
    for source in PAGE.code:
        assert "jacobian([x_cam" not in source
        assert "-h[0]" not in source


def test_the_page_proves_the_faults_of_the_sources():
    """ERRATA A4 and A5 are each proved by assertions with the numbers they give."""
    for words in ("[2.9416, 1.8746]", "[-0.2, 1.8746]", "-3.749", "x_cam - y_cam", "[0.84, 0.54]"):
        assert any(words in source and "assert" in source for source in PAGE.code), words
    assert PAGE.text.index("Two printed answers, audited") < PAGE.text.index("x_cam - y_cam")
