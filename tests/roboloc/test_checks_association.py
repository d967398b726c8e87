import numpy as np
import pytest

from roboloc.checks import association, check, gaussian
from roboloc_reference.association import compute_innovations, measurement_model
from roboloc_reference.gaussian import measurement_update


def unmet(function, stage):
    """Return the names of what is not right yet, and their messages."""
    return {item.name: item.message for item in check(function, stage=stage).items if not item.passed}


@pytest.mark.parametrize("stage", [compute_innovations, measurement_model, measurement_update])
def test_the_right_stages_of_association_and_update_pass(stage):
    """The public checks find nothing wrong with what is right."""
    assert unmet(stage, stage.__name__) == {}


def associate(**changes):
    """Make an association of which one part is another, in loops as a student would."""
    part = {
        "wrap": lambda a: (a + np.pi) % (2 * np.pi) - np.pi,
        "S": lambda P, Q: P + Q,
        "inside": lambda d2, g: d2 < g * g,
        "Q": lambda Q, _S: Q,
        "sign": 1,
        "once": False,
    } | changes

    def function(z_raw, Q_raw, hs, Hs, Sigma, g):
        rows, taken = [], set()
        for z, Q in zip(z_raw.T, Q_raw, strict=True):
            best = None
            for j, (h, H) in enumerate(zip(hs.T, Hs, strict=True)):
                v = part["sign"] * (z - h)
                v[0] = part["wrap"](v[0])
                S = part["S"](H @ Sigma @ H.T, Q)
                d2 = v @ np.linalg.solve(S, v)
                if (best is None or d2 < best[0]) and not (part["once"] and j in taken):
                    best = (d2, v, part["Q"](Q, S), H, j)
            if best and part["inside"](best[0], g):
                rows.append(best[1:4])
                taken.add(best[4])
        v, Q, H = zip(*rows, strict=True) if rows else ([], [], [])
        return np.reshape(v, (-1, 2)), np.reshape(Q, (-1, 2, 2)), np.reshape(H, (-1, 2, len(Sigma)))

    return function


@pytest.mark.parametrize(
    ("changes", "finding"),
    [
        ({"inside": lambda d2, g: d2 < g}, "two standard deviations are inside a gate of 3"),
        ({"inside": lambda _d2, _g: True}, "four standard deviations are outside a gate of 3"),
        ({"wrap": lambda a: a}, "angles are compared across the cut at pi"),
        ({"S": lambda _P, Q: Q}, "a doubtful pose widens the gate"),
        ({"S": lambda P, _Q: P + 1e-9 * np.eye(2)}, "two standard deviations are inside a gate of 3"),
        ({"sign": -1}, "each line goes to its wall, in the order of the lines"),
        ({"once": True}, "two lines may belong to one wall"),
        ({"Q": lambda _Q, S: S}, "a doubtful pose widens the gate"),
    ],
    ids=["g", "no gate", "unwrapped", "S is Q", "S without Q", "sign", "once", "S for Q"],
)
def test_wrong_associations_are_told_what_is_wrong(changes, finding):
    """Each mistake is found by the check that is about it, and says more than yes or no."""
    assert unmet(associate(), "compute_innovations") == {}
    assert unmet(associate(**changes), "compute_innovations")[finding]


def stacked(**changes):
    """Change one part of a right stack."""

    def function(v, Q, H):
        right = dict(zip("zQH", measurement_model(v, Q, H), strict=True))
        return tuple((right | {name: change(v, Q, H) for name, change in changes.items()}).values())

    return function


@pytest.mark.parametrize(
    ("changes", "finding"),
    [
        ({"z": lambda v, _Q, _H: v.T.ravel()}, "z is one line after another"),
        (
            {"Q": lambda _v, Q, _H: np.diag(np.diagonal(Q, axis1=1, axis2=2).ravel())},
            "Q is one block after another on the diagonal",
        ),
        (
            {"Q": lambda _v, Q, _H: np.hstack([Q.reshape(-1, 2)] * len(Q)) if Q.size else np.zeros((0, 0))},
            "Q is one block after another on the diagonal",
        ),
        (
            {"H": lambda _v, _Q, H: H.swapaxes(0, 1).reshape(-1, H.shape[2])},
            "the rows of H go with the numbers of z",
        ),
    ],
    ids=["z", "variances", "full", "H"],
)
def test_wrong_stacks_are_told_what_is_wrong(changes, finding):
    """Each mistake is found by the check that is about it."""
    assert unmet(stacked(**changes), "measurement_model")[finding]


def updated(mean=None, covariance=None):
    """Make an update from formulas of the mean and the covariance."""

    def function(x, Sigma, z, Q, H):
        S = H @ Sigma @ H.T + Q
        K = np.linalg.solve(S, H @ Sigma).T
        right = measurement_update(x, Sigma, z, Q, H)
        return mean(x, z, H, K) if mean else right[0], covariance(Sigma, Q, H, S, K) if covariance else right[
            1
        ]

    return function


@pytest.mark.parametrize(
    ("function", "finding"),
    [
        (updated(mean=lambda x, z, _H, K: x - K @ z), "two opinions meet, weighted by what they know"),
        (
            updated(mean=lambda x, z, H, K: x + K @ (z - H @ x)),
            "two opinions meet, weighted by what they know",
        ),
        (updated(covariance=lambda Sigma, *_: Sigma), "a sharp observation is believed"),
        (
            updated(covariance=lambda Sigma, _Q, _H, S, K: Sigma + K @ S @ K.T),
            "Sigma is symmetric and grows in no direction",
        ),
        (updated(covariance=lambda Sigma, _Q, _H, S, K: Sigma - K @ S @ K.T), "no variance becomes negative"),
        (
            updated(covariance=lambda Sigma, _Q, H, *_: Sigma @ (H.T @ H + np.eye(len(Sigma)))),
            "a useless observation changes nothing",
        ),
    ],
    ids=["sign", "twice", "kept", "grows", "short form", "no covariance"],
)
def test_wrong_updates_are_told_what_is_wrong(function, finding):
    """Each mistake is found by the check that is about it."""
    assert unmet(function, "measurement_update")[finding]


@pytest.mark.parametrize("name", ["compute_innovations", "measurement_model", "measurement_update"])
def test_writing_to_an_argument_is_found(name):
    """A stage that spoils what it was given is told which argument."""
    right = {f.__name__: f for f in (compute_innovations, measurement_model, measurement_update)}[name]

    def spoils(*args):
        results = right(*args)
        args[0][...] = 7.0
        return results

    assert "argument" in unmet(spoils, name)["leaves its arguments as they were"]


def test_no_answer_to_association_is_stored():
    """The checks compute no distance, no gain and no S."""
    for module in (association, gaussian):
        source = module.__loader__.get_source(module.__name__)
        assert "solve" not in source
        assert "inv(" not in source
